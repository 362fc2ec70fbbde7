#include "command.hpp"

#include <fmt/core.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <unistd.h>

namespace {

std::atomic<hexopt::Context*> g_context{nullptr};
volatile std::sig_atomic_t g_interrupted = 0;

// The first signal asks the run to stop at its next safe point; a second one does not wait for that.
extern "C" void on_interrupt(int) {
    if (g_interrupted) std::_Exit(static_cast<int>(hexopt::ErrorCode::cancelled));
    g_interrupted = 1;
    if (hexopt::Context* context = g_context.load()) context->cancel();
}

} // namespace

namespace hexopt::cli {

Session::~Session() {
    clear_live_line();
    g_context = nullptr;
}

void Session::add_common_options(CLI::App& command) {
    command.add_option("--threads", threads_, "Worker threads; 0: all cores")
        ->check(CLI::Range(0, 4096))
        ->capture_default_str();
    command.add_option("--seed", seed_, "Seed of everything random")->capture_default_str();
    command.add_flag("--quiet", quiet_, "Only warnings and errors");
}

Context& Session::context() {
    if (context_) return *context_;
    context_ = std::make_unique<Context>(threads_, seed_);
    context_->set_log_sink([this](LogLevel level, std::string_view message) {
        if (level == LogLevel::debug || (quiet_ && level == LogLevel::info)) return;
        clear_live_line();
        const char* prefix = level == LogLevel::warning ? "warning: "
                             : level == LogLevel::error ? "error: "
                                                        : "";
        fmt::print(stderr, "{}{}\n", prefix, message);
    });
    if (!quiet_)
        context_->set_progress_sink([this](std::string_view stage, double fraction, std::string_view detail) {
            show_progress(stage, fraction, detail);
        });
    g_context = context_.get();
    std::signal(SIGINT, on_interrupt);
    std::signal(SIGTERM, on_interrupt);
    return *context_;
}

void Session::say(const std::string& line) {
    if (quiet_) return;
    clear_live_line();
    fmt::print("{}\n", line);
}

void Session::warn(const std::string& line) {
    clear_live_line();
    fmt::print(stderr, "warning: {}\n", line);
}

void Session::fail(const Error& error) {
    clear_live_line();
    fmt::print(stderr, "error: {}\n", error.one_line());
    exit_code_ = static_cast<int>(error.code);
}

void Session::show_progress(std::string_view stage, double fraction, std::string_view detail) {
    using namespace std::chrono_literals;
    const bool terminal = isatty(STDERR_FILENO) != 0;
    const int percent = static_cast<int>(fraction * 100);
    const bool new_stage = stage != last_stage_;
    const auto now = std::chrono::steady_clock::now();
    if (!new_stage && (terminal ? now - last_shown_ < 100ms : percent / 10 == last_percent_ / 10)) return;
    last_stage_ = stage;
    last_percent_ = percent;
    last_shown_ = now;
    const std::string line =
        fmt::format("[{:3d}%] {}{}{}", percent, stage, detail.empty() ? "" : ": ", detail);
    if (!terminal) {
        fmt::print(stderr, "{}\n", line);
        return;
    }
    fmt::print(stderr, "\r\033[K{}", line.substr(0, 100));
    std::fflush(stderr);
    live_line_ = true;
}

void Session::clear_live_line() {
    if (live_line_) fmt::print(stderr, "\r\033[K");
    live_line_ = false;
}

} // namespace hexopt::cli
