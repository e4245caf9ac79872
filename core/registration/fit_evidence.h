#pragma once

#include "core/body/body_model.h"
#include "core/mesh/scan.h"
#include "core/neural/residual_regression.h"

namespace shaped {

/// How far a scan lies from each vertex of a surface along its normal: the mean over the scan's eight points nearest to
/// the vertex, of those that face its way and lie within a fiftieth of the bounding box's diagonal, m; NaN where there
/// is none. vertices, normals: V x 3. scan: in the surface's place, with normals.
Eigen::VectorXd scanOffsets(const Vertices& vertices, const Vertices& normals, const Scan& scan);

/// What a fit shows of its residual. rest: the fitted identity at rest, X_o, V x 3. scan: carried to rest by the fit
/// (scanAtRest), with normals.
FitEvidence evidenceOf(const BodyState& state, const Vertices& rest, const Faces& faces, const Scan& scan);

}  // namespace shaped
