#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace shaped::shapectl {

/// What a verb asks of the command line. Values are bound by reference and filled before the verb runs; a variable
/// keeps its value when the user says nothing. The values must live as long as the verb.
class Arguments {
 public:
  virtual ~Arguments() = default;

  /// A word that must be given, in order of declaration: "NAME".
  virtual void positional(const std::string& name, std::string& value, const std::string& help) = 0;
  /// Any number of words, `at_least` or more; declare last.
  virtual void positionals(const std::string& name, std::vector<std::string>& values, int at_least,
                           const std::string& help) = 0;

  /// "--modes" or "-o,--output-file"; `value_name` ("J") stands in the help.
  virtual void option(const std::string& flags, std::string& value, const std::string& value_name,
                      const std::string& help) = 0;
  virtual void option(const std::string& flags, std::int64_t& value, const std::string& value_name,
                      const std::string& help) = 0;
  virtual void option(const std::string& flags, double& value, const std::string& value_name,
                      const std::string& help) = 0;
  virtual void option(const std::string& flags, std::optional<double>& value, const std::string& value_name,
                      const std::string& help) = 0;
  /// One word or more after the flag.
  virtual void option(const std::string& flags, std::vector<std::string>& values, const std::string& value_name,
                      const std::string& help) = 0;
  virtual void flag(const std::string& flags, bool& value, const std::string& help) = 0;
  /// Makes the option declared last a required one.
  virtual void required() = 0;
};

}  // namespace shaped::shapectl
