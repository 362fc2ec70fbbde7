#pragma once

#include "stages/optimize/optimize.hpp"

#include <chrono>

namespace hexopt {

/// What is left of a run: time, iterations, the user's patience. Every phase asks before each step.
class Budget {
  public:
    Budget(const OptimizeOptions& options, Context& context)
        : context_(&context), start_(Clock::now()), limit_s_(options.time_limit_s),
          iterations_left_(options.max_iterations) {}

    double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
    bool exhausted() const {
        return context_->is_cancelled() || iterations_left_ <= 0 || seconds() >= limit_s_;
    }
    void spend_iteration() { --iterations_left_; }
    int iterations_left() const { return iterations_left_; }
    Context& context() const { return *context_; }
    const Parallel& parallel() const { return context_->parallel(); }

  private:
    using Clock = std::chrono::steady_clock;
    Context* context_;
    Clock::time_point start_;
    double limit_s_;
    int iterations_left_;
};

} // namespace hexopt
