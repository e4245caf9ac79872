#pragma once

#include <exception>
#include <mutex>
#include <vector>

#include "server/models/served_model.h"
#include "server/scheduling/waiting.h"

namespace shaped::server {

/// A model on its way into memory. Safe from any thread.
class PendingModel : public std::enable_shared_from_this<PendingModel> {
 public:
  /// The model, or what its load threw. Throws Waiting while it is on its way.
  ServedModelPtr get();
  /// As get(), but waits in this thread.
  ServedModelPtr wait();

  /// Calls once it has ended, from any thread, perhaps at once.
  void whenDone(Waiting::Resume resume);

  /// Ends it, once, with a model or a failure; resumes who waits.
  void finish(ServedModelPtr model, std::exception_ptr failure);

 private:
  ServedModelPtr result() const;

  std::mutex mutex_;
  bool done_ = false;
  ServedModelPtr model_;
  std::exception_ptr failure_;
  std::vector<Waiting::Resume> waiting_;
};
using PendingModelPtr = std::shared_ptr<PendingModel>;

}  // namespace shaped::server
