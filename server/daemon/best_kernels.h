#pragma once

namespace shaped::server {

/// Starts the program anew with better kernels for OpenBLAS where betterBlasKernels() knows some. Returns where there
/// is nothing to mend, somebody has chosen kernels, or that fails. To be called before anything else in main().
void useBestBlasKernels();

}  // namespace shaped::server
