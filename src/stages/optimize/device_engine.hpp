#pragma once

#include "stages/optimize/device_driver.hpp"
#include "stages/optimize/device_sliders.hpp"
#include "stages/optimize/minimiser.hpp"

namespace hexopt {

/// Minimisers whose steps are kernels on a backend. Where the device is lost or its memory does not suffice,
/// the step at hand and all later ones run on the `cpu` backend, from the positions that the step began with:
/// with the same bits if the device rounds correctly. A note says so.
class DeviceEngine final : public Engine {
  public:
    /// surface: null where no boundary vertex moves. All must outlive the engine.
    DeviceEngine(const HexMesh& mesh, const BoundaryModel* surface, const DeviceTarget& target,
                 std::span<const Point> positions, Budget& budget, std::vector<std::string>& notes);
    ~DeviceEngine() override;

    std::unique_ptr<Minimiser> open(Problem& problem, std::vector<Point>& positions,
                                    const SurfaceMotion* motion) override;
    double speed() const override { return speed_; }
    bool raises_vertices() const override { return true; }
    bool takes_parts() const override { return false; }
    bool knows_face_limits() const override { return false; }
    bool keeps_sizes() const override { return false; }

    /// The error that the `cpu` backend ended with too; from then on steps do nothing.
    const Status& status() const { return status_; }

  private:
    friend class DeviceMinimiser;

    /// Goes on without the device, if that can help.
    bool move_to_host(const Error& error);
    Result<const DeviceSurface*> surface_on_backend();

    const BoundaryModel* model_;
    DeviceTarget target_;
    Budget& budget_;
    std::vector<std::string>& notes_;
    DeviceFrame frame_;
    double speed_ = 1;
    std::unique_ptr<compute::Backend> host_; ///< once the device has failed
    compute::Backend* backend_;
    std::unique_ptr<DeviceSurface> surface_; ///< on backend_, once a problem has needed it
    Status status_ = Done{};
};

} // namespace hexopt
