#include "core/io/marker_csv.h"

#include <cctype>
#include <cmath>
#include <optional>

#include "core/io/length_unit.h"
#include "core/io/marker_row.h"
#include "core/io/text_scanner.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

struct Header {
  double metres = 1, rate_hz = 0;
  bool has_time = false;
  std::vector<std::string> labels;
};

/// "# units: mm" and "# rate: 120"; any other comment says nothing to us.
void readComment(TextScanner& scanner, std::string_view line, Header& header) {
  line.remove_prefix(1);
  const auto colon = line.find(':');
  if (colon == std::string_view::npos) return;
  TextScanner name("", line.substr(0, colon)), value("", line.substr(colon + 1));
  if (!name.nextLine() || !value.nextLine()) return;
  const auto key = name.word();
  if (!name.word().empty()) return;
  const auto word = value.word();
  if (key == "units") {
    const auto metres = metresPer(word);
    if (!metres) scanner.fail("units are " + quotedWord(word) + "; want mm, cm, dm, m, in or ft");
    header.metres = *metres;
  } else if (key == "rate") {
    header.rate_hz = scanner.numberIn(word, "the rate in frames a second");
    if (!(header.rate_hz > 0) || std::isinf(header.rate_hz)) scanner.fail("the rate must be a positive number");
  }
}

/// Reads the columns; each label stands three times, with _x, _y and _z.
void readColumns(TextScanner& scanner, Header& header) {
  const auto columns = scanner.fields(',');
  if (columns[0] != "frame") scanner.fail("the first column is " + quotedWord(columns[0]) + "; want 'frame'");
  header.has_time = columns.size() > 1 && columns[1] == "time";
  const std::size_t first = header.has_time ? 2 : 1;
  for (std::size_t i = first; i < columns.size(); ++i) {
    const std::string suffix = std::string("_") + "xyz"[(i - first) % 3];
    const auto column = columns[i];
    const auto label = column.substr(0, column.size() - std::min<std::size_t>(2, column.size()));
    const bool same = (i - first) % 3 == 0 ? !label.empty() : label == header.labels.back();
    if (!column.ends_with(suffix) || !same)
      scanner.fail("column " + std::to_string(i + 1) + " is " + quotedWord(column) +
                   "; want label_x, label_y, label_z one after the other");
    if ((i - first) % 3 == 0) header.labels.emplace_back(label);
  }
  if (header.labels.empty() || (columns.size() - first) % 3 != 0)
    scanner.fail("want label_x, label_y, label_z columns");
}

Header readHeader(TextScanner& scanner, const std::string& file) {
  Header header;
  while (scanner.nextLine()) {
    const auto line = scanner.restOfLine();
    if (line.find_first_not_of(" \t,") == std::string_view::npos) continue;
    if (line.starts_with('#')) {
      readComment(scanner, line, header);
      continue;
    }
    readColumns(scanner, header);
    return header;
  }
  throw InvalidInput(file, "has no header line 'frame,label_x,label_y,label_z,...'");
}

/// Frames a second of a trial that lasts so long [s]; 0 where the times do not say.
double rateOf(std::size_t frames, double duration) {
  const double rate = static_cast<double>(frames - 1) / duration;
  return duration > 0 && std::isfinite(rate) ? rate : 0;
}

}  // namespace

MarkerTrial parseMarkerCsv(const std::string& file, std::string_view text) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // the mark that spreadsheets put before UTF-8
  TextScanner scanner(file, text);
  auto header = readHeader(scanner, file);
  MarkerTrial trial{std::move(header.labels), header.rate_hz, {}};
  std::optional<std::int64_t> last_frame;
  double first_time = 0, last_time = 0;
  while (scanner.nextContentLine('#')) {
    const auto fields = scanner.fields(',');
    const auto frame = scanner.integerIn(fields[0], "the frame number");
    if (last_frame && (frame <= *last_frame || frame - 1 != *last_frame))
      scanner.fail("frame " + std::to_string(frame) + " follows frame " + std::to_string(*last_frame) +
                   "; write a row for every frame, with blank fields where nothing was seen");
    last_frame = frame;
    requireFilledRows(scanner, trial.frames.size() + 1, trial.labels.size(), text.size());
    if (header.has_time) {
      last_time = scanner.numberIn(fields.size() > 1 ? fields[1] : std::string_view(), "the time in seconds");
      if (trial.frames.empty()) first_time = last_time;
    }
    const auto coordinates = std::span(fields).subspan(std::min<std::size_t>(header.has_time ? 2 : 1, fields.size()));
    trial.frames.push_back(parseMarkerRow(scanner, coordinates, trial.labels, header.metres, false));
  }
  if (trial.frames.empty()) throw InvalidInput(file, "has no frames");
  if (trial.rate_hz == 0) trial.rate_hz = rateOf(trial.frames.size(), last_time - first_time);
  return trial;
}

std::string formatMarkerCsv(const MarkerTrial& trial) {
  std::string text = "# units: m\n";
  if (trial.rate_hz > 0) text += "# rate: " + shortest(trial.rate_hz) + "\n";
  text += "frame";
  for (const auto& label : trial.labels)
    for (const char* axis : {"_x", "_y", "_z"}) text += "," + label + axis;
  text += "\n";
  for (std::size_t f = 0; f < trial.frames.size(); ++f) {
    text += std::to_string(f + 1);
    for (const double x : trial.frames[f].reshaped<Eigen::RowMajor>())
      text += std::isnan(x) ? std::string(",") : "," + shortest(x);
    text += "\n";
  }
  return text;
}

}  // namespace shaped
