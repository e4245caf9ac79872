#pragma once

#include "core/mesh/topology.h"

namespace shaped::test {

/// W[s, s~] straight from the definition in [HZRS18]: 2 x 2 first fundamental forms and their strain, dihedral angles
/// from normals by arc cosine with the sign of the fold. Slow, and written independently of core/shell.
double literalShellEnergy(const Topology& topology, const Vertices& undeformed, const Vertices& deformed, double eta);

}  // namespace shaped::test
