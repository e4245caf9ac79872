#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace shaped {

/// A word of a file for an error text: shortened, and free of bytes that a terminal could not print.
std::string quotedWord(std::string_view word);

/// The shortest decimal text that reads back as exactly this number.
std::string shortest(double value);

/// Walks a text line by line and each line word by word (blanks, tabs). Errors are InvalidInput("file:line", ...).
/// Lines end with LF, CR LF or CR. The text must outlive the scanner.
class TextScanner {
 public:
  TextScanner(std::string file, std::string_view text) : file_(std::move(file)), rest_(text) {}

  /// Goes to the next line; false at the end of the text.
  bool nextLine();
  /// Goes to the next line that holds more than blanks and a comment; `comment` starts one and ends the line there.
  bool nextContentLine(char comment);
  /// What is left of the current line.
  std::string_view restOfLine() const { return line_; }

  /// The rest of the line cut at every separator, blanks around each field removed; at least one field.
  std::vector<std::string_view> fields(char separator);

  /// The next word of the line; empty at its end.
  std::string_view word();
  /// The next word as a number, NaN and infinity included. what: its role, for the error text.
  double number(std::string_view what);
  /// The next word as a whole number.
  std::int64_t integer(std::string_view what);

  /// A field or word as a number; fails as number() does.
  double numberIn(std::string_view field, std::string_view what) const;
  std::int64_t integerIn(std::string_view field, std::string_view what) const;

  std::int64_t lineNumber() const { return line_number_; }
  [[noreturn]] void fail(const std::string& problem) const;

 private:
  std::string file_;
  std::string_view rest_, line_;
  std::int64_t line_number_ = 0;
};

/// The whole word as a number ("1", "-2.5e3", "+1", "nan", "inf"); false when it is anything else.
bool parseNumber(std::string_view word, double& value);
/// The whole word as an integer; false when it is anything else or out of range.
bool parseInteger(std::string_view word, std::int64_t& value);

}  // namespace shaped
