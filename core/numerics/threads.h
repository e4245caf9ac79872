#pragma once

namespace shaped {

/// Limits OpenBLAS and OpenMP (which CHOLMOD uses inside) to one thread. Parallelism is ours: over shapes, frames and
/// requests. Call once at program start, before the first solver.
void limitLibraryThreads();

/// Limits OpenMP for the calling thread; the setting is not inherited, so every thread that factorises calls it.
void limitOpenMpInThisThread();

}  // namespace shaped
