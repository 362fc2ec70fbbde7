#pragma once

#include "stages/optimize/device_surface.hpp"
#include "stages/optimize/surface_motion.hpp"

namespace hexopt {

/// The boundary dofs of a problem on a backend: struct Slider in shaders/dialect/kernel_surface.glsl.
class DeviceSliders {
  public:
    /// Per dof of the problem: whether it is one, i.e. bound to the surface.
    static std::vector<std::uint8_t> find(const Problem& problem, const BoundaryModel& model);

    /// device: made with find()'s answer. All must outlive the sliders.
    static Result<DeviceSliders> create(DeviceProblem& device, const DeviceSurface& surface,
                                        const BoundaryModel& model);

    /// Takes the limits over, which may have changed, and where to begin the search for closest points.
    /// positions: of all vertices, as uploaded.
    Status upload(const SurfaceLimits& limits, std::span<const Point> positions, const Parallel& parallel);

    std::uint32_t count() const { return static_cast<std::uint32_t>(dof_.size()); }
    /// Sum of the limits' energies goes to `total` (one real).
    compute::BufferRef energy() const { return energy_.ref(); }

    void project(compute::Recorder& recorder, const compute::Buffer& points) const;
    void limit(compute::Recorder& recorder, const compute::Buffer& points, double weight) const;
    void restrict_gradient(compute::Recorder& recorder, const compute::Buffer& gradient,
                           const compute::Buffer& block) const;
    void restrict_product(compute::Recorder& recorder, const compute::Buffer& step,
                          const compute::Buffer& product) const;
    void sweep_newton(compute::Recorder& recorder, std::size_t colour, double eps, double omega,
                      double weight) const;
    void sweep_raise(compute::Recorder& recorder, std::size_t colour, compute::BufferRef worst,
                     compute::BufferRef raised, double margin, double gain) const;

  private:
    Status allocate();

    DeviceProblem* device_ = nullptr;
    const DeviceSurface* surface_ = nullptr;
    const BoundaryModel* model_ = nullptr;
    std::vector<Index> dof_;       ///< of each slider, rising
    std::vector<Index> last_;      ///< element of the last projection of each slider, on the host
    Csr<std::uint32_t> by_colour_; ///< sliders of each colour of the problem
    compute::Buffer slide_, list_, limits_, direction_, energy_, limit_gradient_, limit_block_;
};

} // namespace hexopt
