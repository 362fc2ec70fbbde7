#pragma once

#include "stages/optimize/device_sliders.hpp"
#include "stages/optimize/newton.hpp"

namespace hexopt {

/// Counts over the cells of a problem, as the device sees them.
struct DeviceQuality {
    double bad8 = 0, bad32 = 0, min_sj = 1, sum_sj = 0;
};

/// The default method's inner loops as recordings on a backend: what the host reads back between them is a
/// block of a few numbers. Every call leaves the positions on the device, hanging vertices included.
class DeviceSolver {
  public:
    /// sliders: the boundary dofs, kept on their surface and within their limits by minimise() and the sweeps
    /// of sweep_newton() and sweep_raise(); null: there are none. Must outlive the solver.
    static Result<std::unique_ptr<DeviceSolver>> create(DeviceProblem& device,
                                                        const DeviceSliders* sliders = nullptr);

    /// Target sizes from the current positions, as Problem::update_lengths.
    Status update_lengths();
    Result<ObjectiveValue> evaluate(const Objective& objective);
    Result<DeviceQuality> measure();
    Result<std::vector<CellMeasure>> measure_cells();

    /// `sweeps` passes of one Newton step a dof, colour after colour; over-relaxed by omega where that lowers
    /// a ball's energy.
    /// blocks: the kernel for regular blocks does what it can; else the general one does all.
    Status sweep_newton(double eps, int sweeps, double omega = 1.6, bool blocks = true);
    /// Newton steps with matrix-free conjugate gradients on all dofs at once.
    Result<NewtonResult> minimise(const Objective& objective, const NewtonOptions& options,
                                  const Budget& budget);
    /// Solves the weighted graph Laplacian for the dofs; the number of iterations.
    Result<int> harmonic_start(double tolerance, int max_iterations);
    /// One max-min pass over balls within `margin` of the least scaled Jacobian that was measured last; how
    /// many dofs moved.
    Result<std::size_t> sweep_raise(double margin, double gain);
    /// The same and measure() in one submission.
    Result<DeviceQuality> raise_and_measure(double margin, double gain);
    /// One Laplacian pass, colour after colour.
    Status sweep_laplacian(bool smart);

    /// Deepest-point linear program for each dof, colour after colour (thesis 4.2.3, method.md); f64 only.
    /// box_rel: how far a dof may go, in target lengths. Returns what each dof's program reached: the least J
    /// / |dJ/dd|.
    Result<std::vector<double>> sweep_untangle(double box_rel);
    /// One Jacobi step of weighted steepest descent on the hyper-elastic energy (thesis 3.2 and section 3.6).
    Status step_hyperelastic(double relaxation);

    /// Gradient of the objective by each dof, per model unit; of sliders what they may follow, after
    /// minimise().
    Result<std::vector<Point>> compute_gradient(const Objective& objective);
    /// The same of an energy by forward differences (thesis 4.24); step_rel: step over the mean target
    /// length.
    Result<std::vector<Point>> compute_difference_gradient(Energy energy, double eps, double step_rel);

    /// Keeps the positions on the device, and brings them back.
    Status save();
    Status restore();

    DeviceProblem& device() { return device_; }

  private:
    DeviceSolver(DeviceProblem& device, const DeviceSliders* sliders) : device_(device), sliders_(sliders) {}
    Status allocate();
    Status run();
    Result<std::vector<double>> run_and_read(const compute::Buffer& buffer, std::size_t count);
    void record_measure();
    Result<DeviceQuality> read_quality();
    void record_raise(double margin, double gain);
    void record_gradient(const Objective& objective);
    Result<std::vector<Point>> read_gradient();
    void constrain(const compute::Buffer& points);
    void reduce(bool sum, compute::BufferRef source, std::uint32_t count, compute::BufferRef target);
    void dot(const compute::Buffer& a, const compute::Buffer& b, compute::BufferRef target);
    void record_energy(const Objective& objective, const compute::Buffer& points);
    Result<ObjectiveValue> read_value();
    void record_product(const Objective* objective);
    Result<int> solve(const Objective* objective, double tolerance, int max_iterations);
    Result<bool> search_line(const Objective& objective, double slope, ObjectiveValue& value);
    compute::BufferRef slot(int number) const;

    DeviceProblem& device_;
    const DeviceSliders* sliders_;
    compute::Recorder recorder_;
    compute::Buffer trial_, saved_, energy_, least_, third_, partial_[2], status_, scalars_;
    compute::Buffer gradient_, block_, solution_, residual_, preconditioned_, direction_, product_, field_,
        cell_vectors_, raised_;
};

} // namespace hexopt
