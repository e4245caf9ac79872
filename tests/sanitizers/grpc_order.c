// Tells the thread sanitizer what gRPC's completion queues order: what was done before an operation was given to gRPC comes before
// what its tag's taker does. The queues themselves are atomics inside libgrpc, which the sanitizer does not see. Preloaded.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <grpc/grpc.h>

// Weak: programs without the sanitizer run under it too.
__attribute__((weak)) void __tsan_acquire(void* address);
__attribute__((weak)) void __tsan_release(void* address);

static void* next(const char* name) { return dlsym(RTLD_NEXT, name); }

grpc_call_error grpc_call_start_batch(grpc_call* call, const grpc_op* ops, size_t count, void* tag, void* reserved) {
  static grpc_call_error (*real)(grpc_call*, const grpc_op*, size_t, void*, void*);
  if (!real) real = next("grpc_call_start_batch");
  if (tag && __tsan_release) __tsan_release(tag);
  return real(call, ops, count, tag, reserved);
}

grpc_event grpc_completion_queue_next(grpc_completion_queue* queue, gpr_timespec deadline, void* reserved) {
  static grpc_event (*real)(grpc_completion_queue*, gpr_timespec, void*);
  if (!real) real = next("grpc_completion_queue_next");
  const grpc_event event = real(queue, deadline, reserved);
  if (event.type == GRPC_OP_COMPLETE && event.tag && __tsan_acquire) __tsan_acquire(event.tag);
  return event;
}
