#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <stop_token>

namespace shaped::server {

/// How a job ended.
enum class JobEnd {
  kDone,     ///< field.safetensors is written
  kStopped,  ///< the stop token fired; checkpoint.safetensors is written once training had begun
  kDiverged  ///< the loss was no longer a finite number; the last checkpoint stays
};

/// Does the job of a folder (server/trainer/job_spec.h), from its checkpoint on where there is one. tell: receives what
/// happens, one object a line of the program's output:
///   {"event": "start", "pairs": 30, "parameters": 93001, "step": 0}          step: of the checkpoint
///   {"event": "epoch", "epoch": 1, "epochs": 100, "loss": .., "vertex": .., "jacobian": .., "learning_rate": ..,
///    "seconds": 12.5}                                                       since the start of this run
///   {"event": "checkpoint", "step": 8}
///   {"event": "done" | "stopped" | "diverged", "step": 800}
/// Throws InvalidInput naming the file and field, also for a checkpoint of another training or of other inputs;
/// FileError when something cannot be written.
JobEnd train(const std::filesystem::path& folder, const std::function<void(const nlohmann::json&)>& tell,
             const std::stop_token& stop);

}  // namespace shaped::server
