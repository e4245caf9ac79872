#include <Eigen/Geometry>
#include <random>

#include "tests/benchmark/experiments/experiment.h"
#include "tests/benchmark/experiments/models.h"
#include "tests/benchmark/experiments/timing.h"

namespace shaped::experiments {
namespace {

/// Each shape turned about any axis and moved by up to its own size.
DataSet moved(DataSet set) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  for (auto& shape : set.shapes) {
    const Eigen::Matrix3d rotation = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
                                         .normalized()
                                         .toRotationMatrix();
    const Eigen::RowVector3d shift(normal(random), normal(random), normal(random));
    shape = ((shape * rotation.transpose()).rowwise() + shift).eval();
  }
  return set;
}

void compareEigenvalues(Report& report, const DataSet& set) {
  const int modes = static_cast<int>(set.shapes.size()) - 1;
  const auto turned_set = moved(set);
  const auto original = train(set, modes), turned = train(turned_set, modes);
  if (!original.solution || !turned.solution) throw std::runtime_error("training ended without a model");
  const Eigen::VectorXd before = original.solution->pga().eigenvalues.head(modes),
                        after = turned.solution->pga().eigenvalues.head(modes);
  const double each = ((after - before).cwiseAbs().array() / before.array()).maxCoeff();
  const bool same_mesh = original.solution->parts().coarsening.kept == turned.solution->parts().coarsening.kept;
  report.entry(text("%s: largest relative change of any of %d eigenvalues", set.name.c_str(), modes),
               text("%.1e (%s, %s; smallest over largest eigenvalue %.1e; the coarse vertices are %s)", each,
                    name(original.termination).data(), name(turned.termination).data(), before[modes - 1] / before[0],
                    same_mesh ? "the same" : "others"),
               "<= 1e-6", each <= 1e-6);
  report.entry(
      set.name + ": change of the default bending weight",
      text("%.1e relative", std::abs(turned.solution->parts().bending / original.solution->parts().bending - 1)));
}

}  // namespace

void row11RigidMotions() {
  Report report("Row 11: rigid motions of every training shape");
  compareEigenvalues(report, cactus());
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < 72; i += 6) chosen.push_back(i);
  compareEigenvalues(report, subset(bodies1k(), chosen));
}

}  // namespace shaped::experiments
