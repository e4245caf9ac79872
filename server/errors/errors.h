#pragma once

#include <stdexcept>
#include <string>

// Why a request cannot be served, where InvalidInput (the request itself is wrong) does not fit. Each maps to one gRPC
// status, in server/errors/status.h; a thrower names what it is about.
namespace shaped::server {

/// No such model, version, dataset or job.
class NotFound : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The name is taken.
class AlreadyExists : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Too many jobs wait; the same request may succeed later.
class Busy : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Another program keeps a file of the store locked; the same request may succeed once that one has let go.
class StoreLocked : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What is asked for does not go with the state that its object is in; it may, later.
class WrongState : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The caller's roles do not go so far.
class NotAllowed : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A model does not fit into the memory budget.
class OverBudget : public std::runtime_error {
 public:
  /// may_pass: whether it would fit once requests have let go of others.
  OverBudget(const std::string& text, bool may_pass) : std::runtime_error(text), may_pass_(may_pass) {}
  bool mayPass() const { return may_pass_; }

 private:
  bool may_pass_;
};

/// A file of the store does not hold what was written to it.
class Corrupted : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The stop token fired before there was an answer; the call knows whether its client or its deadline did it.
class Stopped : public std::runtime_error {
 public:
  Stopped() : std::runtime_error("stopped before there was an answer") {}
};

}  // namespace shaped::server
