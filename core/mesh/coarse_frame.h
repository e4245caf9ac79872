#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/mesh/topology.h"

namespace shaped {

/// What a coarse shape says about the surface around it, as vectors that turn with the shape: C positions, then C
/// normals (of each vertex: the sum of its triangles' edge cross products, divided by the root of its length, so that
/// it is a length [m] that scales with the shape and fades to zero where the triangles lose their area). 2C x 3.
///
/// Whatever is linear in these rows, with weights that sum to 1 over the positions, follows rigid motions and uniform
/// scaling of the coarse shape exactly and depends on it continuously.
Vertices frameVectors(const Faces& coarse_faces, const Vertices& coarse);

/// A deformation gradient as a linear function of frame vectors f: G = sum_i f_i weight_i^T.
struct GradientStencil {
  struct Term {
    std::int32_t row;        ///< of the frame vectors
    Eigen::Vector3d weight;  ///< [1/m]
  };
  std::vector<Term> terms;
};

/// For each coarse vertex the gradient of the deformation from `reference` (C x 3): the least-squares map of its edges
/// (weighted by inverse length) and of its normal onto the deformed ones. Identity for the reference, R for a rotation
/// by R. Where the reference leaves a direction open (a degenerate one-ring) the gradient stays bounded instead.
std::vector<GradientStencil> gradientStencils(const Topology& coarse, const Vertices& reference);

}  // namespace shaped
