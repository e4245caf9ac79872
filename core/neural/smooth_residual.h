#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/mesh/types.h"
#include "core/surface/spectrum.h"

namespace shaped {

/// How smooth the displacements of a surface are, and how far the scan's offsets are to be believed.
struct SmoothPrior {
  double
      reach;  ///< l, m, > 0: displacements further apart than this along the surface have little to do with each other
  double noise;  ///< variance of an offset seen all over the surface, relative to that of a displacement, > 0
};

/// Throws InvalidInput naming `prior` and its number that is out of range.
void require(const SmoothPrior& prior);

/// What a linear model's fit leaves of a body, seen as a smooth displacement of the surface: a Gaussian process with
/// the Matern kernel of the surface's Laplacian, u = Phi c with independent c_k of variance (1 + l^2 lambda_k)^-3/2
/// (smoothness 1/2; Whittle 1963; on surfaces Borovitskiy et al. 2020), conditioned on the offsets of the scan along
/// the normals. The mean of that is what is added; as in Gaussian process morphable models [Luethi et al. 2018] it
/// knows of no body but that surfaces bend evenly, so it serves beside what few bodies teach. Ours.
///
/// spectrum: of the reference, V vertices and k functions. normals: V x 3, unit, of the surface that is displaced.
/// offsets: V values, of the scan from each vertex along its normal [m]; NaN where none is near. Returns the
/// displacements, V x 3 [m]; zero where no offset is known at all. Throws InvalidInput naming `normals` or `offsets` of
/// another count, or a prior out of range.
Vertices smoothResidual(const SurfaceSpectrum& spectrum, const SmoothPrior& prior, const Vertices& normals,
                        const Eigen::VectorXd& offsets);

/// A body that a fit left something of.
struct SmoothExample {
  Vertices normals;         ///< V x 3
  Eigen::VectorXd offsets;  ///< V, as above
  Vertices residual;        ///< V x 3: what is to be added [m]
};

struct FittedSmoothness {
  std::optional<SmoothPrior> prior;  ///< none where no displacement comes nearer than none at all
  double before = 0, after = 0;      ///< root mean square over examples and vertices of what is left [m]
};

/// The prior that leaves least of the examples, out of four reaches (a twentieth to four tenths of `extent`, m) and
/// five shares of noise (1e-6 to 1e-2). No example teaches it more than these two numbers, so none are held out.
/// Throws InvalidInput naming `examples[i]` when its sizes are not the spectrum's.
FittedSmoothness fitSmoothness(const SurfaceSpectrum& spectrum, double extent,
                               const std::vector<SmoothExample>& examples);

}  // namespace shaped
