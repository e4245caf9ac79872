#include "client/shapectl/command_line.h"

#include <CLI/CLI.hpp>
#include <iostream>

#include "client/shapectl/failure.h"
#include "client/shapectl/token_source.h"

namespace shaped::shapectl {
namespace {

constexpr char kFooter[] =
    "Exit codes: 0 success, 1 internal error, 2 bad input, 3 not found, 4 daemon unavailable or busy, 5 deadline "
    "exceeded, "
    "6 cancelled, 7 written but not converged, 8 denied: no valid token or certificate, or not the role.";

/// Arguments of one verb on a CLI11 subcommand.
class CliArguments : public Arguments {
 public:
  explicit CliArguments(CLI::App& app) : app_(app) {}

  void positional(const std::string& name, std::string& value, const std::string& help) override {
    app_.add_option(name, value, help)->required();
  }
  void positionals(const std::string& name, std::vector<std::string>& values, int at_least,
                   const std::string& help) override {
    auto* option = app_.add_option(name, values, help);
    if (at_least > 0) option->required()->expected(at_least, CLI::detail::expected_max_vector_size);
  }
  void option(const std::string& flags, std::string& value, const std::string& value_name,
              const std::string& help) override {
    add(flags, value, value_name, help);
  }
  void option(const std::string& flags, std::int64_t& value, const std::string& value_name,
              const std::string& help) override {
    add(flags, value, value_name, help);
  }
  void option(const std::string& flags, double& value, const std::string& value_name,
              const std::string& help) override {
    add(flags, value, value_name, help);
  }
  void option(const std::string& flags, std::optional<double>& value, const std::string& value_name,
              const std::string& help) override {
    add(flags, value, value_name, help);
  }
  void option(const std::string& flags, std::vector<std::string>& values, const std::string& value_name,
              const std::string& help) override {
    add(flags, values, value_name, help);
  }
  void flag(const std::string& flags, bool& value, const std::string& help) override {
    last_ = app_.add_flag(flags, value, help);
  }
  void required() override { last_->required(); }

 private:
  template <class Value>
  void add(const std::string& flags, Value& value, const std::string& value_name, const std::string& help) {
    last_ = app_.add_option(flags, value, help)->option_text(value_name);
  }

  CLI::App& app_;
  CLI::Option* last_ = nullptr;
};

void declareConnection(CLI::App& app, client::ConnectionOptions& connection, std::string& token_file) {
  app.add_option("--server", connection.server, "The daemon, host:port; replicas with commas between")
      ->envname("SHAPED_SERVER")
      ->capture_default_str();
  app.add_flag("--tls", connection.tls, "Connect over TLS; --ca and --cert imply it")->envname("SHAPED_TLS");
  app.add_option("--ca", connection.ca, "Trust daemons of these authorities (PEM), not the system's")
      ->envname("SHAPED_CA");
  app.add_option("--cert", connection.certificate, "Certificate to show to the daemon (PEM), with --key")
      ->envname("SHAPED_CERT");
  app.add_option("--key", connection.key, "Its private key (PEM)")->envname("SHAPED_KEY");
  app.add_option("--token-file", token_file, "File that holds the token to call with; or SHAPED_TOKEN holds it")
      ->envname("SHAPED_TOKEN_FILE");
}

void declareGlobals(CLI::App& app, Session& session, std::string& output) {
  app.add_option("--output", output, "text or json")->check(CLI::IsMember({"text", "json"}))->capture_default_str();
  app.add_option("--timeout", session.timeout, "Longest time of a call [s]")->check(CLI::PositiveNumber);
  app.add_option("--priority", session.priority, "How urgent calls are: interactive, normal (where not given) or batch")
      ->check(CLI::IsMember({"interactive", "normal", "batch"}))
      ->envname("SHAPED_PRIORITY");
}

/// CLI11 says by its own codes what was wrong; ours has one for a bad command line.
int parseFailure(const CLI::App& app, const CLI::ParseError& error) {
  return app.exit(error) == 0 ? static_cast<int>(ExitCode::kSuccess) : static_cast<int>(ExitCode::kBadInput);
}

}  // namespace

int runCommandLine(int argc, char** argv, const std::vector<Verb>& verbs, std::stop_token stop) {
  CLI::App app("shapectl: shape models at the terminal, served by shaped");
  app.footer(kFooter);
  Session session{.connection = {}, .json = false, .timeout = {}, .priority = {}, .stop = std::move(stop)};
  session.connection.server = "127.0.0.1:50051";
  std::string output = "text", token_file;
  declareConnection(app, session.connection, token_file);
  declareGlobals(app, session, output);
  app.require_subcommand(1)->fallthrough();
  for (const auto& verb : verbs) {
    CliArguments arguments(*app.add_subcommand(verb.name, verb.help)->fallthrough());
    verb.declare(arguments);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return parseFailure(app, error);
  }
  session.json = output == "json";
  const auto& chosen = app.get_subcommands().front()->get_name();
  for (const auto& verb : verbs)
    if (verb.name == chosen)
      return static_cast<int>(reportingFailures(session, [&] {
        session.connection.token = tokenOf(token_file);
        return verb.run(session);
      }));
  return static_cast<int>(ExitCode::kInternal);
}

}  // namespace shaped::shapectl
