#pragma once

#include <filesystem>
#include <vector>

#include "shaped/v1/registration.pb.h"

namespace shaped::shapectl {

/// Reads points of a model that are known on a scan:
///   {"landmarks": [{"vertex": 968, "position": [0.1, 1.4, 0.2]},
///                  {"face": 17, "barycentric": [0.2, 0.3, 0.5], "position": [0, 0.9, 0.1], "weight": 2}]}
/// with positions in the scan's unit. Other fields are skipped. Throws InvalidInput naming the file and the landmark;
/// what is not on the model, the daemon says.
std::vector<v1::ScanLandmark> readScanLandmarks(const std::filesystem::path& path);

/// The same of several scans, a list for each of `scans`: every landmark also has "frame", the scan's index from 0,
/// which may be left out where there is one scan.
std::vector<std::vector<v1::ScanLandmark>> readSequenceLandmarks(const std::filesystem::path& path, std::int64_t scans);

}  // namespace shaped::shapectl
