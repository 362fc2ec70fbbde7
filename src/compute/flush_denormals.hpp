#pragma once

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace hexopt::compute {

/// While it lives, denormal numbers count as zero on this thread, as on Mesa's software device, whose results
/// the host's must equal bit for bit.
class FlushDenormals {
  public:
    FlushDenormals(const FlushDenormals&) = delete;
    FlushDenormals& operator=(const FlushDenormals&) = delete;
#if defined(__SSE2__)
    FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | kFlushToZero | kDenormalsAreZero); }
    ~FlushDenormals() { _mm_setcsr(saved_); }

  private:
    static constexpr unsigned kFlushToZero = 0x8000, kDenormalsAreZero = 0x0040;
    unsigned saved_;
#else
    FlushDenormals() {}
#endif
};

} // namespace hexopt::compute
