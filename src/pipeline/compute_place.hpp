#pragma once

#include "compute/backend.hpp"
#include "core/parallel.hpp"
#include "core/result.hpp"
#include "stages/optimize/device_driver.hpp"

#include <memory>
#include <optional>
#include <string>

namespace hexopt {

/// Where a user wants the optimizer to compute.
struct ComputeRequest {
    std::string device = "auto"; ///< as compute::choose_device() takes it
    compute::Precision precision = compute::Precision::f64;
    compute::Backend* backend = nullptr; ///< an open one to compute on instead of `device`

    bool is_host() const {
        return !backend && (device == "auto" || device == "cpu") && precision == compute::Precision::f64;
    }
};

/// Where it computes; without a backend: by the host's vectorised code.
struct ComputePlace {
    std::unique_ptr<compute::Backend> owned;
    compute::Backend* backend = nullptr;
    compute::Precision precision = compute::Precision::f64;
    std::string reason; ///< the place's name, and why there

    /// For optimize(); none: the host.
    std::optional<DeviceTarget> target() const {
        if (!backend) return std::nullopt;
        return DeviceTarget{backend, precision};
    }
};

/// Opens the place that was asked for. Errors: those of compute::open_device().
Result<ComputePlace> open_place(const ComputeRequest& request, const Parallel& parallel);

} // namespace hexopt
