#include "pipeline/compute_place.hpp"

#include "compute/device_choice.hpp"

namespace hexopt {

Result<ComputePlace> open_place(const ComputeRequest& request, const Parallel& parallel) {
    ComputePlace place;
    place.precision = request.precision;
    if (request.backend) {
        place.backend = request.backend;
        place.reason = request.backend->capabilities().name + ": given by the host application";
        return place;
    }
    Result<compute::OpenedDevice> opened = compute::open_device(request.device, request.precision);
    if (!opened) return opened.error();
    place.reason = opened->choice.reason;
    place.owned = std::move(opened->backend);
    if (!place.owned && request.precision != compute::Precision::f64)
        place.owned = compute::create_cpu_backend(parallel);
    place.backend = place.owned.get();
    return place;
}

} // namespace hexopt
