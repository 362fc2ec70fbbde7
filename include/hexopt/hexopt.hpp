/// hexopt: untangles and improves hexahedral meshes. C++20 interface, header-only over hexopt.h, so that the
/// library's binary interface stays the C one. See hexopt.h for what each field means.
#ifndef HEXOPT_HPP
#define HEXOPT_HPP

#include "hexopt/hexopt.h"

#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace hexopt::inline v1 {

/// A call that left no result; what() says why, where, and what to do.
class Failure : public std::runtime_error {
  public:
    Failure(hexopt_status status, const std::string& message)
        : std::runtime_error(message), status_(status) {}
    hexopt_status status() const { return status_; }

  private:
    hexopt_status status_;
};

struct Options {
    int threads = 0; ///< 0: all cores
    std::uint64_t seed = 1;
    std::function<void(hexopt_log_level, std::string_view message)> log;
    /// Return false to cancel. fraction: 0..1, never decreasing.
    std::function<bool(std::string_view stage, double fraction, std::string_view detail)> progress;
};

/// Runs one call at a time; any number of optimizers may be used at once from different threads. What a
/// callback throws ends the call and is thrown again from it.
class Optimizer {
  public:
    explicit Optimizer(Options options = {}) : state_(std::make_unique<State>(std::move(options))) {
        hexopt_context_options c = HEXOPT_CONTEXT_OPTIONS_INIT;
        c.threads = state_->options.threads;
        c.seed = state_->options.seed;
        c.user = state_.get();
        if (state_->options.log) c.log = &on_log;
        if (state_->options.progress) c.progress = &on_progress;
        hexopt_context* context = nullptr;
        const hexopt_status status = hexopt_context_create(&c, &context);
        if (status != HEXOPT_OK) throw Failure(status, "hexopt_context_create: check threads");
        context_.reset(context);
    }

    /// Ends the call under way, and no other, at its next safe point. From any thread.
    void cancel() noexcept { hexopt_context_cancel(context_.get()); }

  private:
    struct State {
        explicit State(Options o) : options(std::move(o)) {}
        Options options;
        std::exception_ptr thrown;
    };
    struct Destroy {
        void operator()(hexopt_context* context) const { hexopt_context_destroy(context); }
    };

    static void on_log(void* user, hexopt_log_level level, const char* message) noexcept {
        State& state = *static_cast<State*>(user);
        try {
            if (!state.thrown) state.options.log(level, message);
        } catch (...) {
            state.thrown = std::current_exception();
        }
    }
    static int on_progress(void* user, const char* stage, double fraction, const char* detail) noexcept {
        State& state = *static_cast<State*>(user);
        try {
            return state.thrown || !state.options.progress(stage, fraction, detail);
        } catch (...) {
            state.thrown = std::current_exception();
            return 1;
        }
    }

    std::unique_ptr<State> state_;
    std::unique_ptr<hexopt_context, Destroy> context_;
};

} // namespace hexopt::inline v1

#endif
