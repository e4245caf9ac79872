#pragma once

#include <random>

#include "core/mesh/topology.h"

namespace shaped::test {

struct Mesh {
  TopologyPtr topology;
  Vertices vertices;
};

/// Unit icosphere with `levels` subdivisions: 12, 42, 162, 642 vertices.
Mesh icosphere(int levels);

/// Flat square grid with n x n vertices in z = 0, side 1, with a boundary.
Mesh grid(int n);

/// Closed tube along x with `rings` rings of `sides` vertices and two caps, length 4, radius 1/2.
Mesh tube(int rings, int sides);

/// Each coordinate plus a uniform number in [-amount, amount].
Vertices jitter(const Vertices& shape, double amount, unsigned seed);

/// Bends a tube along x by `angle` radians about z, keeping its length.
Vertices bend(const Vertices& shape, double angle);

/// A random rotation about a random axis and a random translation.
Vertices moveRigidly(const Vertices& shape, unsigned seed);

}  // namespace shaped::test
