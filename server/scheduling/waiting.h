#pragma once

#include <functional>
#include <utility>

namespace shaped::server {

/// Thrown by a handler that has done nothing yet and needs what is still on its way, a model that is being loaded: no
/// error, but a way to wait without a thread. The call gives its worker back, and runs again from the start once
/// resumed.
class Waiting {
 public:
  using Resume = std::function<void()>;

  /// subscribe: keeps the function it is given and calls it once, from any thread, perhaps at once.
  explicit Waiting(std::function<void(Resume)> subscribe) : subscribe_(std::move(subscribe)) {}
  void then(Resume resume) const { subscribe_(std::move(resume)); }

 private:
  std::function<void(Resume)> subscribe_;
};

}  // namespace shaped::server
