#pragma once

#include "core/parallel.hpp"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace hexopt {

enum class LogLevel { debug, info, warning, error };

/// What a caller lends to every stage: cancellation, progress, log, threads and seed. Not copyable; one
/// Context serves one run at a time, but cancel() may be called from any thread or signal handler.
class Context {
  public:
    using LogSink = std::function<void(LogLevel, std::string_view message)>;
    /// stage: e.g. "untangle"; fraction in 0..1 over the whole run, never decreasing; detail: counts, may be
    /// empty.
    using ProgressSink =
        std::function<void(std::string_view stage, double fraction, std::string_view detail)>;

    explicit Context(int threads = 0, std::uint64_t seed = 1) : parallel_(threads), seed_(seed) {}
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    void set_log_sink(LogSink sink) { log_ = std::move(sink); }
    void set_progress_sink(ProgressSink sink) { progress_ = std::move(sink); }

    /// Sticky: once set, every stage ends at its next safe point with ErrorCode::cancelled.
    void cancel() noexcept { cancelled_.store(true, std::memory_order_relaxed); }
    bool is_cancelled() const noexcept { return cancelled_.load(std::memory_order_relaxed); }

    /// Makes the context ready for another run: not cancelled, no progress. Not while a run is under way.
    void restart() noexcept {
        cancelled_.store(false, std::memory_order_relaxed);
        fraction_ = 0;
        set_progress_range(0, 1);
    }

    void log(LogLevel level, std::string_view message) const;
    /// Fractions reported from now on are of this part of the run; 0 <= low <= high <= 1.
    void set_progress_range(double low, double high) {
        range_low_ = low;
        range_high_ = high;
    }
    /// Reports progress; a fraction below the last one is raised to it.
    void report(std::string_view stage, double fraction, std::string_view detail = {});

    const Parallel& parallel() const { return parallel_; }
    std::uint64_t seed() const { return seed_; }

  private:
    Parallel parallel_;
    std::uint64_t seed_;
    std::atomic<bool> cancelled_{false};
    double fraction_ = 0;
    double range_low_ = 0, range_high_ = 1;
    LogSink log_;
    ProgressSink progress_;
};

} // namespace hexopt
