#pragma once

#include <string>
#include <vector>

#include "client/shapectl/session.h"

namespace shaped::shapectl {

/// Motions on the daemon for the length of a verb: .npy files are uploaded as datasets and deleted when this goes;
/// a word that is no file names a dataset that is there and stays.
class MotionSource {
 public:
  /// template_file: the connectivity of .npy files; needed where there is one. Throws InvalidInput naming the file or
  /// --template, and RpcError.
  MotionSource(const Session& session, const std::vector<std::string>& motions, const std::string& template_file);
  ~MotionSource();
  MotionSource(const MotionSource&) = delete;
  MotionSource& operator=(const MotionSource&) = delete;

  /// Of the datasets, in the order of the motions.
  const std::vector<std::string>& names() const { return names_; }

 private:
  void deleteUploaded() const;
  void upload(const std::string& file, const std::string& template_file);

  const Session& session_;
  std::vector<std::string> names_, uploaded_;
};

}  // namespace shaped::shapectl
