#include "client/shapectl/motion_source.h"

#include <algorithm>
#include <filesystem>

#include "client/dataset_upload.h"
#include "client/shapectl/progress_bar.h"
#include "core/numerics/error.h"

namespace shaped::shapectl {

MotionSource::MotionSource(const Session& session, const std::vector<std::string>& motions,
                           const std::string& template_file)
    : session_(session) {
  try {
    for (const auto& motion : motions) {
      if (std::filesystem::exists(motion))
        upload(motion, template_file);
      else if (motion.ends_with(".npy"))
        throw InvalidInput(motion, "there is no such file");
      else
        names_.push_back(motion);
    }
  } catch (...) {
    deleteUploaded();
    throw;
  }
}

MotionSource::~MotionSource() { deleteUploaded(); }

void MotionSource::deleteUploaded() const {
  for (const auto& name : uploaded_) try {
      v1::DeleteDatasetRequest request;
      request.set_name(name);
      v1::DeleteDatasetResponse response;
      client::Call call({.timeout = std::chrono::seconds(5), .stop = {}});
      v1::Datasets::NewStub(session_.channel())->Delete(call.context(), request, &response);
    } catch (...) {
      // It stays on the daemon, where `Datasets.Delete` finds it.
    }
}

void MotionSource::upload(const std::string& file, const std::string& template_file) {
  if (template_file.empty()) throw InvalidInput("--template", "is missing: it gives the connectivity of " + file);
  const client::ShapeSource shapes(template_file, file);
  const auto name = client::contentName(shapes, "motion");
  names_.push_back(name);
  if (std::find(uploaded_.begin(), uploaded_.end(), name) != uploaded_.end()) return;
  ProgressBar bar;
  const auto count = static_cast<double>(shapes.count());
  client::uploadDataset(session_.channel(), name, shapes, session_.callOptions(),
                        [&](std::int64_t sent) { bar.show(static_cast<double>(sent) / count, "uploading " + file); });
  uploaded_.push_back(name);
}

}  // namespace shaped::shapectl
