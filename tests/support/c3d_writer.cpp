#include "tests/support/c3d_writer.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace shaped::test {
namespace {

/// Appends numbers in a processor's formats, by arithmetic alone, so that it shares nothing with the reader.
class Writer {
 public:
  explicit Writer(C3dProcessor processor) : processor_(processor) {}

  std::string bytes;

  void byte(int value) { bytes += static_cast<char>(value & 255); }
  void word(std::int64_t value) {
    const int low = static_cast<int>(value & 255), high = static_cast<int>((value >> 8) & 255);
    const bool big = processor_ == C3dProcessor::kMips;
    byte(big ? high : low);
    byte(big ? low : high);
  }
  void real(double value) {
    if (processor_ == C3dProcessor::kDec) return vax(value);
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
    const bool big = processor_ == C3dProcessor::kMips;
    word(big ? bits >> 16 : bits & 65535);
    word(big ? bits & 65535 : bits >> 16);
  }
  void pad(std::size_t multiple) { bytes.resize((bytes.size() + multiple - 1) / multiple * multiple, '\0'); }

 private:
  void vax(double value) {
    int exponent = 0;
    const double fraction = std::frexp(std::abs(value), &exponent);  // 0.5 <= fraction < 1
    const auto mantissa = static_cast<std::uint32_t>(std::llround(std::ldexp(fraction, 24))) & 0x7fffff;
    const std::uint32_t sign = value < 0 ? 0x8000 : 0;
    const std::uint32_t power = value == 0 ? 0 : static_cast<std::uint32_t>(exponent + 128) << 7;
    word(sign | power | mantissa >> 16);
    word(mantissa & 65535);
  }

  C3dProcessor processor_;
};

void group(Writer& out, int id, const std::string& name) {
  out.byte(static_cast<int>(name.size()));
  out.byte(-id);
  out.bytes += name;
  out.word(3);
  out.byte(0);
}

/// data: already in the file's format.
void parameter(Writer& out, int id, const std::string& name, int type, const std::vector<int>& extents,
               const std::string& data) {
  out.byte(-static_cast<int>(name.size()));  // locked
  out.byte(id);
  out.bytes += name;
  out.word(static_cast<std::int64_t>(2 + 1 + 1 + extents.size() + data.size() + 1));
  out.byte(type);
  out.byte(static_cast<int>(extents.size()));
  for (const int extent : extents) out.byte(extent);
  out.bytes += data;
  out.byte(0);
}

void words(Writer& out, int id, const std::string& name, const C3dOptions& options,
           std::initializer_list<std::int64_t> values) {
  Writer data(options.processor);
  for (const auto value : values) data.word(value);
  parameter(out, id, name, 2,
            values.size() == 1 ? std::vector<int>{} : std::vector<int>{static_cast<int>(values.size())}, data.bytes);
}

void real(Writer& out, int id, const std::string& name, const C3dOptions& options, double value) {
  Writer data(options.processor);
  data.real(value);
  parameter(out, id, name, 4, {}, data.bytes);
}

void labels(Writer& out, const MarkerTrial& trial, std::size_t per_parameter) {
  std::size_t width = 1;
  for (const auto& label : trial.labels) width = std::max(width, label.size());
  for (std::size_t begin = 0, part = 1; begin < trial.labels.size(); begin += per_parameter, ++part) {
    std::string text;
    const auto end = std::min(trial.labels.size(), begin + per_parameter);
    for (std::size_t i = begin; i < end; ++i)
      text += trial.labels[i] + std::string(width - trial.labels[i].size(), ' ');
    parameter(out, 1, part == 1 ? "LABELS" : "LABELS" + std::to_string(part), -1,
              {static_cast<int>(width), static_cast<int>(end - begin)}, text);
  }
}

std::string parameterSection(const MarkerTrial& trial, const C3dOptions& options, std::int64_t data_block) {
  Writer out(options.processor);
  const auto frames = static_cast<std::int64_t>(trial.frames.size());
  out.byte(1);
  out.byte(0x50);
  out.byte(0);  // number of blocks, patched by the caller
  out.byte(static_cast<int>(options.processor));
  words(out, 1, "USED", options, {options.point_used.value_or(static_cast<int>(trial.labels.size()))});
  group(out, 1, "POINT");  // after its first parameter, as the format allows
  words(out, 1, "FRAMES", options,
        {options.point_frames.value_or(static_cast<int>(std::min<std::int64_t>(frames, 65535)))});
  words(out, 1, "DATA_START", options, {data_block});
  real(out, 1, "SCALE", options, options.scale);
  real(out, 1, "RATE", options, trial.rate_hz);
  if (!options.units.empty()) parameter(out, 1, "UNITS", -1, {static_cast<int>(options.units.size())}, options.units);
  if (options.long_frames) real(out, 1, "LONG_FRAMES", options, static_cast<double>(frames));
  labels(out, trial, options.labels_per_parameter);
  if (options.trial_group) {
    group(out, 2, "Trial");
    const std::int64_t begin = options.first_frame, end = begin + frames - 1;
    words(out, 2, "ACTUAL_START_FIELD", options, {begin & 65535, begin >> 16});
    words(out, 2, "ACTUAL_END_FIELD", options, {end & 65535, end >> 16});
  }
  out.byte(0);
  out.pad(512);
  out.bytes[2] = static_cast<char>(out.bytes.size() / 512);
  return out.bytes;
}

void header(Writer& out, const MarkerTrial& trial, const C3dOptions& options, std::int64_t data_block) {
  const auto last = options.first_frame + static_cast<std::int64_t>(trial.frames.size()) - 1;
  out.byte(2);
  out.byte(0x50);
  out.word(static_cast<std::int64_t>(trial.labels.size()));
  out.word(options.analog_values);
  out.word(std::min(options.first_frame, 65535));
  out.word(options.header_last_frame.value_or(static_cast<int>(std::min<std::int64_t>(last, 65535))));
  out.word(10);
  out.real(options.scale);
  out.word(data_block);
  out.word(options.analog_values > 0 ? 1 : 0);
  out.real(trial.rate_hz);
  out.pad(512);
}

void number(Writer& out, const C3dOptions& options, double file_units) {
  if (options.scale < 0)
    out.real(file_units);
  else
    out.word(std::llround(file_units / options.scale));
}

void frame(Writer& out, const Vertices& points, const C3dOptions& options) {
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    const bool missing = !points.row(p).allFinite();
    for (int c = 0; c < 3; ++c)
      number(out, options, !missing ? points(p, c) * options.units_per_metre : options.missing_by_zero ? 0 : 7);
    const int residual = missing && !options.missing_by_zero ? -1 : 0x0102;
    if (options.scale < 0)
      out.real(residual);
    else
      out.word(residual);
  }
  for (int a = 0; a < options.analog_values; ++a) number(out, options, a * std::abs(options.scale));
}

}  // namespace

std::string formatC3d(const MarkerTrial& trial, const C3dOptions& options) {
  const auto blocks = static_cast<std::int64_t>(parameterSection(trial, options, 0).size() / 512);
  Writer out(options.processor);
  header(out, trial, options, 2 + blocks);
  out.bytes += parameterSection(trial, options, 2 + blocks);
  for (const auto& points : trial.frames) frame(out, points, options);
  out.pad(512);
  return out.bytes;
}

}  // namespace shaped::test
