#pragma once

#include <grpcpp/support/sync_stream.h>

#include <string>
#include <type_traits>
#include <utility>

#include "client/connection.h"
#include "client/mesh.h"
#include "client/shapectl/progress_bar.h"
#include "core/io/frames.h"

namespace shaped::shapectl {

/// Takes a stream of the Curves service: shows its progress, writes its frames to a .npy file, n x V x 3, that appears
/// once all are there, and returns its summary. Throws RpcError; no file is left then.
template <class Response>
auto receiveCurve(grpc::ClientReader<Response>& stream, const std::string& out) {
  FrameWriter writer(out);
  std::decay_t<decltype(std::declval<Response>().summary())> summary;
  {
    ProgressBar bar;
    for (Response response; stream.Read(&response);) {
      if (response.has_progress()) bar.show(response.progress().fraction(), response.progress().stage());
      if (response.has_frame()) writer.append(client::unpack(response.frame().shape().positions()));
      if (response.has_summary()) summary = response.summary();
    }
  }
  client::require(stream.Finish());
  writer.close();
  return summary;
}

}  // namespace shaped::shapectl
