#pragma once

#include <vector>

#include "core/mesh/topology.h"

namespace shaped::test {

/// W,1[s, t] and W,2[s, t] by differences of the literal shell energy, V x 3: nothing of core/shell is involved.
Vertices literalFirstForce(const Topology& topology, const Vertices& s, const Vertices& t, double eta);
Vertices literalSecondForce(const Topology& topology, const Vertices& s, const Vertices& t, double eta);

/// |sum of the forces| over the sum of their norms: 0 in balance.
double relativeImbalance(const std::vector<Vertices>& forces);

/// The largest relative imbalance of (23), W,2[s_{k-1}, s_k] + W,1[s_k, s_{k+1}], over a path's inner shapes.
double literalPathImbalance(const Topology& topology, const std::vector<Vertices>& path, double eta);

/// K sum_k W[s_{k-1}, s_k] with the literal energy.
double literalPathEnergy(const Topology& topology, const std::vector<Vertices>& path, double eta);

}  // namespace shaped::test
