#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

namespace shaped {

/// One dense layer: W x + b of an item's features x.
struct Linear {
  Eigen::MatrixXf weight;  ///< out x in
  Eigen::VectorXf bias;    ///< out
};

/// What becomes of the last layer's output.
enum class OutputActivation {
  kNone,  ///< a regression
  kRelu,  ///< features for another network
};

/// Multilayer perceptron in single precision: dense layers with a ReLU, max(0, x), after each but the last. Immutable,
/// and usable from several threads at once.
class Mlp {
 public:
  /// layers: one at least, each taking what the one before gives. Throws InvalidInput naming `name`.layers[i] when its
  /// weight is empty, its bias has not as many numbers as the weight has rows, its inputs are not the outputs before,
  /// or a number is not finite.
  explicit Mlp(std::vector<Linear> layers, OutputActivation output = OutputActivation::kNone, std::string name = "mlp");

  /// items: N x inputs(), one item a row. N x outputs(), each row a function of its row alone. Throws InvalidInput
  /// naming `name` when the items have another count of features.
  Eigen::MatrixXf operator()(const Eigen::MatrixXf& items) const;

  Eigen::Index inputs() const { return layers_.front().weight.cols(); }
  Eigen::Index outputs() const { return layers_.back().weight.rows(); }
  const std::vector<Linear>& layers() const { return layers_; }
  OutputActivation outputActivation() const { return output_; }
  const std::string& name() const { return name_; }

 private:
  std::vector<Linear> layers_;
  OutputActivation output_;
  std::string name_;
};

/// What a PointNet says of a set of points.
struct PointFeatures {
  Eigen::MatrixXf each;      ///< N x D, one point a row
  Eigen::RowVectorXf whole;  ///< D: the largest of each column, so that neither order nor repetition matters
};

/// PointNet [Qi et al. 2017, section 4.2], without its input transforms: one perceptron shared by all points, with a
/// ReLU after its last layer too, and the maximum over the points as the feature of the whole set.
class PointNet {
 public:
  /// Throws as Mlp does.
  explicit PointNet(std::vector<Linear> layers, std::string name = "pointnet")
      : shared_(std::move(layers), OutputActivation::kRelu, std::move(name)) {}

  /// points: N x inputs(), N >= 1, such as positions, or positions with normals. Throws InvalidInput naming the network
  /// when there is no point, or as Mlp does.
  PointFeatures operator()(const Eigen::MatrixXf& points) const;

  Eigen::Index inputs() const { return shared_.inputs(); }
  Eigen::Index outputs() const { return shared_.outputs(); }
  const Mlp& shared() const { return shared_; }

 private:
  Mlp shared_;
};

}  // namespace shaped
