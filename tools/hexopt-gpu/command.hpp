#pragma once

#include "core/context.hpp"
#include "core/result.hpp"

#include <CLI/CLI.hpp>

#include <chrono>
#include <memory>
#include <string>

namespace hexopt::cli {

/// What every subcommand shares. A subcommand adds its options, sets a callback with App::callback(), and in
/// the callback uses context(), say() and fail().
class Session {
  public:
    ~Session();

    /// Adds --threads, --seed and --quiet.
    void add_common_options(CLI::App& command);

    /// The run's context: made on the first call from the common options; Ctrl-C and SIGTERM cancel it;
    /// progress and log go to stderr (a live line on a terminal, plain lines otherwise).
    Context& context();

    /// One line on stdout, unless --quiet.
    void say(const std::string& line);
    /// "warning: ..." on stderr.
    void warn(const std::string& line);
    /// "error: ..." on stderr; sets the exit code.
    void fail(const Error& error);
    /// Sets the exit code without a message.
    void end_with(ErrorCode code) { exit_code_ = static_cast<int>(code); }

    bool quiet() const { return quiet_; }
    int threads() const { return threads_; }
    std::uint64_t seed() const { return seed_; }
    int exit_code() const { return exit_code_; }

  private:
    void show_progress(std::string_view stage, double fraction, std::string_view detail);
    void clear_live_line();

    int threads_ = 0;
    std::uint64_t seed_ = 1;
    bool quiet_ = false;
    int exit_code_ = 0;
    std::unique_ptr<Context> context_;
    bool live_line_ = false;
    std::string last_stage_;
    int last_percent_ = -1;
    std::chrono::steady_clock::time_point last_shown_{};
};

// To add a subcommand: a line in commands.def, and add_NAME() defined in command_NAME.cpp.
#define HEXOPT_COMMAND(name) void add_##name(CLI::App& app, Session& session);
#include "commands.def"
#undef HEXOPT_COMMAND

} // namespace hexopt::cli
