#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/body/body_training.h"
#include "core/bootstrap/bootstrap_checkpoint.h"
#include "core/bootstrap/bootstrap_options.h"
#include "core/bootstrap/bootstrap_report.h"
#include "core/bootstrap/field_trainer.h"
#include "core/numerics/progress.h"

namespace shaped {

/// A registration that teaches the field, with a scan of the same body.
struct FieldExample {
  Vertices registration;     ///< V x 3, m: where the scan stands, or in any posture and place
  std::optional<Scan> scan;  ///< none: the virtual scanner makes some of it, in postures near rest
};

/// Raw scans that are loaded when it is their turn, so that they need not all be in memory.
struct ScanSource {
  std::size_t count = 0;
  /// Scan i; called from several threads at once, and again for the scans that join. InvalidInput: the scan is left
  /// aside and said so; whatever else it throws ends the bootstrap.
  std::function<Scan(std::size_t)> load;
  std::function<std::string(std::size_t)> name;  ///< for reports
};

/// What a bootstrap works on.
struct BootstrapInputs {
  PostureTemplate reference;
  std::vector<Vertices> registrations;  ///< R_PCA, two at least, V x 3
  std::vector<FieldExample> examples;   ///< R_DEFORM with its scans, one at least; none of R_PCA
  ScanSource scans;                     ///< U
};

/// How a bootstrap is watched and stopped. The functions may be empty and are called from any thread, one call at a
/// time.
struct BootstrapWatch {
  std::stop_token stop = {};
  ProgressSink progress = {};
  std::function<void(const BootstrapScan&)> each_scan = {};    ///< as soon as it is registered
  std::function<void(const BootstrapRound&)> each_round = {};  ///< at its end
  BootstrapCheckpointSink checkpoint = {};
};

/// A model that has grown.
struct Bootstrapped {
  BodyModel model;
  Eigen::VectorXd variances;   ///< of all modes of the last R_PCA, falling [m^2]
  JacobianFieldWeights field;  ///< of the model
  std::vector<BootstrapRound> rounds;
  std::vector<Vertices> joined;  ///< X' at rest, in the order in which they joined, V x 3
  BootstrapEnd end;
};

/// R_PCA after that many rounds: what the model began with, then, where registrations are shared, R_DEFORM, then what
/// joined. A field belongs to the model that is learned of them in this order.
std::vector<Vertices> modelRegistrations(const BootstrapInputs& inputs, const BootstrapOptions& options,
                                         std::size_t rounds, const std::vector<Vertices>& joined);

/// BLiSS ([Mur25] section 3.3, Algorithm 2). Each round learns a model from R_PCA, fits it to the scans of R_DEFORM and
/// trains a field to make their registrations of the fits, registers the unregistered scans with both, and moves those
/// to R_PCA whose chamfer distance (both ways, posed surface and scan) is at most the smallest plus `acceptance`
/// standard deviations. Ours: a fit that failed or scores below registration.least_score is not compared and never
/// joins. It ends when fewer than least_joined join, no scan is left, or the rounds are done; model and field are then
/// learned once more from what there is. Before the first round R_PCA and R_DEFORM are apart, later both and what
/// joined teach both, the latter by virtual scans of X' (share_registrations).
///
/// Ours, too: what the model's fits leave of R_DEFORM is learned by a ridge regression first (fitResiduals), and the
/// field what that leaves, from predictions for each body by a regression without it. Between them goes a smooth
/// residual (fitSmoothness), where it helps. The targets are the registrations at rest (posture normalised, rigidly
/// aligned to X_o), and X' joins at rest, as in the paper: limbs of a small model's fit turn to make up for what its
/// identities lack, and the target at rest does not.
///
/// From ten registrations in R_DEFORM on, every fifth judges the field, which is trained on the others: one that brings
/// these no nearer is silenced, and its round goes by the regression alone (progress says so).
///
/// resumed: a checkpoint of the same inputs and options, whose fingerprint the caller has compared; each_scan and
/// each_round do not tell again what it holds. The result has the same bits with or without interruptions, whatever the
/// number of threads; scans are parallelised over the caller's oneTBB arena. Nothing when the stop token fired.
/// Throws InvalidInput naming `options`, `registrations[i]`, `examples[i].registration`, `examples[i].scan`, `scans`,
/// or saying that no example can be fitted; and what load and train throw.
std::optional<Bootstrapped> bootstrapBody(const BootstrapInputs& inputs, const FieldTrainer& train,
                                          const BootstrapOptions& options = {}, const BootstrapWatch& watch = {},
                                          std::optional<BootstrapCheckpoint> resumed = std::nullopt);

}  // namespace shaped
