#include "core/io/trc.h"

#include <cmath>

#include "core/io/length_unit.h"
#include "core/io/marker_row.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

struct Header {
  double rate_hz, metres;
  std::int64_t frame_count, marker_count;
};

void nextLine(TextScanner& scanner, const std::string& file, const char* what) {
  if (!scanner.nextLine()) throw InvalidInput(file, "is truncated: ends before " + std::string(what));
}

std::string_view valueOf(const TextScanner& scanner, std::span<const std::string_view> names,
                         std::span<const std::string_view> values, std::string_view name) {
  for (std::size_t i = 0; i < names.size() && i < values.size(); ++i)
    if (names[i] == name) return values[i];
  scanner.fail("the header has no value for " + std::string(name));
}

Header readHeader(TextScanner& scanner, const std::string& file) {
  nextLine(scanner, file, "its header");
  if (!scanner.restOfLine().starts_with("PathFileType")) scanner.fail("a TRC file begins with 'PathFileType'");
  nextLine(scanner, file, "the names of its header");
  const auto names = scanner.fields('\t');
  nextLine(scanner, file, "the values of its header");
  const auto values = scanner.fields('\t');
  const auto value = [&](std::string_view name) { return valueOf(scanner, names, values, name); };
  const auto metres = metresPer(value("Units"));
  if (!metres) scanner.fail("Units is " + quotedWord(value("Units")) + "; want mm, cm, dm, m, in or ft");
  const Header header{scanner.numberIn(value("DataRate"), "DataRate"), *metres,
                      scanner.integerIn(value("NumFrames"), "NumFrames"),
                      scanner.integerIn(value("NumMarkers"), "NumMarkers")};
  if (header.frame_count < 1 || header.marker_count < 1) scanner.fail("NumFrames and NumMarkers must be at least 1");
  return header;
}

std::vector<std::string> readLabels(TextScanner& scanner, const std::string& file, std::int64_t marker_count) {
  nextLine(scanner, file, "its labels");
  const auto fields = scanner.fields('\t');
  if (!fields[0].starts_with("Frame")) scanner.fail("the line of the labels begins with 'Frame#'");
  std::vector<std::string> labels;
  for (std::size_t i = 2; i < fields.size(); i += 3)
    if (!fields[i].empty()) labels.emplace_back(fields[i]);
  if (static_cast<std::int64_t>(labels.size()) != marker_count)
    scanner.fail("has " + std::to_string(labels.size()) + " labels, one every three fields; NumMarkers is " +
                 std::to_string(marker_count));
  nextLine(scanner, file, "the line of X1, Y1, Z1");
  return labels;
}

}  // namespace

MarkerTrial parseTrc(const std::string& file, std::string_view text) {
  TextScanner scanner(file, text);
  const auto header = readHeader(scanner, file);
  const bool has_rate = std::isfinite(header.rate_hz) && header.rate_hz > 0;
  MarkerTrial trial{readLabels(scanner, file, header.marker_count), has_rate ? header.rate_hz : 0, {}};
  while (scanner.nextLine()) {
    if (scanner.restOfLine().find_first_not_of(" \t") == std::string_view::npos) continue;
    const auto fields = scanner.fields('\t');
    scanner.integerIn(fields[0], "the frame number");
    requireFilledRows(scanner, trial.frames.size() + 1, trial.labels.size(), text.size());
    const auto coordinates = std::span(fields).subspan(std::min<std::size_t>(2, fields.size()));
    trial.frames.push_back(parseMarkerRow(scanner, coordinates, trial.labels, header.metres, true));
  }
  if (static_cast<std::int64_t>(trial.frames.size()) != header.frame_count)
    throw InvalidInput(file, "promises " + std::to_string(header.frame_count) + " frames (NumFrames), but " +
                                 std::to_string(trial.frames.size()) + " are there");
  return trial;
}

std::string formatTrc(const MarkerTrial& trial) {
  const std::string rate = shortest(trial.rate_hz), frames = std::to_string(trial.frames.size()),
                    markers = std::to_string(trial.labels.size());
  std::string text = "PathFileType\t4\t(X/Y/Z)\tmarkers.trc\n";
  text += "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n";
  for (const auto& field : {rate, rate, frames, markers, std::string("mm"), rate, std::string("1")})
    text += field + "\t";
  text += frames + "\nFrame#\tTime";
  for (const auto& label : trial.labels) text += "\t" + label + "\t\t";
  text += "\n\t";
  for (std::size_t m = 1; m <= trial.labels.size(); ++m)
    for (const char* axis : {"\tX", "\tY", "\tZ"}) text += axis + std::to_string(m);
  text += "\n\n";
  for (std::size_t f = 0; f < trial.frames.size(); ++f) {
    text += std::to_string(f + 1);
    text += "\t" + shortest(trial.rate_hz > 0 ? static_cast<double>(f) / trial.rate_hz : 0);
    for (const double x : trial.frames[f].reshaped<Eigen::RowMajor>())
      text += std::isnan(x) ? std::string("\t") : "\t" + shortest(x * 1e3);
    text += "\n";
  }
  return text;
}

}  // namespace shaped
