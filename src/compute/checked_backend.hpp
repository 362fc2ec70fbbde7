#pragma once

#include "compute/backend.hpp"

namespace hexopt::compute {

/// How far a kernel's results on one backend were from another's, over all its dispatches so far.
struct KernelDifference {
    const KernelInfo* kernel = nullptr;
    Precision precision = Precision::f64;
    std::size_t dispatches = 0;
    std::size_t different_words = 0; ///< numbers that differ in any bit
    double largest_rel = 0;          ///< largest difference, relative to the largest value of its array
    /// What kernels.def allows a real GPU.
    double bound() const { return precision == Precision::f64 ? kernel->bound_f64 : kernel->bound_f32; }
};

/// Runs everything on two backends and compares, after each dispatch, every buffer that the kernel has: also
/// those it only reads, which neither may change. The reference's results then replace the other's, so that
/// each dispatch is judged on equal input.
class CheckedBackend : public Backend {
  public:
    virtual const std::vector<KernelDifference>& differences() const = 0;
};

/// Both backends must outlive it.
std::unique_ptr<CheckedBackend> create_checked_backend(Backend& reference, Backend& tested);

} // namespace hexopt::compute
