#pragma once

#include <cstdint>
#include <string>

namespace shaped::server {

/// The largest that requests may be; told to clients by Server.GetLimits. All >= 1.
struct Limits {
  std::int64_t vertices = 2'000'000;                      ///< of a mesh
  std::int64_t faces = 4'000'000;                         ///< of a mesh
  std::int64_t frames = 100'000;                          ///< of a dataset, and of a take that a job fits
  std::int64_t message_bytes = 64 << 20;                  ///< of a message, either way; < 2^31
  std::int64_t coefficients = 4096;                       ///< weights of a point of a model
  std::int64_t handles = 100'000;                         ///< of an edit
  std::int64_t markers = 10'000;                          ///< of a marker set
  std::int64_t calibration_frames = 16;                   ///< at the begin of a marker stream
  std::int64_t path_steps = 1024;                         ///< K of an interpolation
  std::int64_t times = 10'000;                            ///< shapes that an interpolation sends
  std::int64_t job_bytes = std::int64_t{4} << 30;         ///< that are sent for one job, and of one job's result
  std::int64_t curve_bytes = std::int64_t{512} << 20;     ///< of the frames that a curve holds at once, as doubles
  std::int64_t clothing_frames = 1000;                    ///< scans that are estimated together under clothing
  std::int64_t clothing_bytes = std::int64_t{256} << 20;  ///< of their points, normals and faces, as the core has them
  std::int64_t upload_bytes = std::int64_t{4} << 30;      ///< of an uploaded model's tensors
};

/// Throws InvalidInput naming `field` when the count is above `most`. of: what is counted, "vertices".
void requireAtMost(std::int64_t count, std::int64_t most, const std::string& field, const std::string& of);

}  // namespace shaped::server
