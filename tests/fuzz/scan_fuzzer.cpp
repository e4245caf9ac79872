#include <cmath>

#include "core/io/scan_file.h"
#include "tests/fuzz/fuzz.h"

using namespace shaped;
using namespace shaped::fuzz;

namespace {

void requireScan(const Scan& scan) {
  require(scan.points.rows() > 0 && scan.points.allFinite(), "a scan has points, and they are finite");
  require(scan.normals.rows() == 0 || scan.normals.rows() == scan.points.rows(),
          "every point has a normal, or none has");
  for (const auto& normal : scan.normals.rowwise())
    require(std::abs(normal.norm() - 1) < 1e-12, "normals have unit length");
  require(scan.faces.rows() == 0 || (scan.faces.minCoeff() >= 0 && scan.faces.maxCoeff() < scan.points.rows()),
          "corners are points");
}

/// What is read as this format must be a scan that survives being written.
void readAndRewrite(std::string_view bytes, const char* extension) {
  const auto file = scratchFile(std::string("scan") + extension, bytes);
  const auto scan = accepted<InvalidInput>([&] { return readScan(file); });
  if (!scan) return;
  requireScan(*scan);
  const auto copy = scratchFolder() / "copy.ply";
  writeScan(copy, *scan);
  const auto back = readScan(copy);
  require(back.points == scan->points && back.normals == scan->normals && back.faces == scan->faces, "scans survive");
}

}  // namespace

FUZZ_TARGET(scan) {
  for (const char* extension : {".ply", ".obj", ".off", ".stl", ".npy", ".xyz"}) readAndRewrite(bytes, extension);
}
