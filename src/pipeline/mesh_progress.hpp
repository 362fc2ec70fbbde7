#pragma once

#include "core/context.hpp"

namespace hexopt {

/// Ends of the stages' parts of a run that meshes a surface, 0..1.
namespace progress {
inline constexpr double kSurfaceEnd = 0.05, kRefineEnd = 0.1, kTrimEnd = 0.2, kFitEnd = 0.35,
                        kBufferEnd = 0.45, kOptimizeEnd = 0.85, kSettleEnd = 0.92, kMeasureEnd = 0.97;
} // namespace progress

inline void begin_stage(Context& context, const char* stage, double low, double high) {
    context.set_progress_range(low, high);
    context.report(stage, 0);
}

} // namespace hexopt
