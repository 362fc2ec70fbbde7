#include "stages/optimize/device_solver.hpp"

#include "stages/optimize/regular_blocks.hpp"

#include <algorithm>
#include <cmath>

namespace hexopt {

using compute::Buffer;
using compute::BufferRef;
namespace args = compute::args;

namespace {

// Numbers in the status block.
enum Slot {
    kEnergy,
    kLeastJacobian,
    kBad8,
    kBad32,
    kMinSj,
    kSumSj,
    kLengthSum,
    kSlope,
    kRaised,
    kLimits,
    kSlots
};
// Numbers of the conjugate gradients: the first two as shaders/kernels/cg_step.glsl has them, then r.z before
// and after a step, which take turns.
enum CgScalar { kFirstRz, kCurvature, kRz, kOtherRz, kCgScalars };

constexpr std::uint32_t kReduceWidth = 2048;
constexpr std::uint32_t kDotWidth = 512;
constexpr int kCgIterationsBetweenReads = 8;
constexpr int kMaxHalvings = 20;
constexpr double kArmijo = 1e-4;
constexpr float kLengthFloorRel = 1e-3f;
constexpr double kTimeout_s = 600;

std::uint32_t blocks(std::uint32_t count, std::uint32_t width) { return (count + width - 1) / width; }

} // namespace

Result<std::unique_ptr<DeviceSolver>> DeviceSolver::create(DeviceProblem& device,
                                                           const DeviceSliders* sliders) {
    std::unique_ptr<DeviceSolver> solver(
        new DeviceSolver(device, sliders && sliders->count() > 0 ? sliders : nullptr));
    if (auto status = solver->allocate(); !status) return status.error();
    return solver;
}

Status DeviceSolver::allocate() {
    const std::size_t real = device_.real_bytes(), vector = 3 * real;
    const std::size_t vertices = device_.vertex_count, cells = device_.cell_count, dofs = device_.dof_count;
    const std::size_t widest = std::max(cells, dofs);
    struct Request {
        Buffer* buffer;
        std::size_t bytes;
        const char* label;
    };
    const Request requests[] = {
        {&trial_, vertices * device_.point_bytes(), "trial positions"},
        {&saved_, vertices * device_.point_bytes(), "saved positions"},
        {&energy_, cells * real, "cell energies"},
        {&least_, cells * real, "cell minima"},
        {&third_, cells * real, "cell flags"},
        {&partial_[0], (widest / kDotWidth + 1) * real, "partial sums"},
        {&partial_[1], (widest / kReduceWidth + 2) * real, "partial sums"},
        {&status_, kSlots * real, "status"},
        {&scalars_, kCgScalars * real, "scalars"},
        {&gradient_, dofs * vector, "gradient"},
        {&block_, dofs * 2 * vector, "Hessian blocks"},
        {&solution_, dofs * vector, "solution"},
        {&residual_, dofs * vector, "residual"},
        {&preconditioned_, dofs * vector, "preconditioned residual"},
        {&direction_, dofs * vector, "direction"},
        {&product_, dofs * vector, "product"},
        {&field_, vertices * vector, "field"},
        {&cell_vectors_, cells * 8 * vector, "cell vectors"},
        {&raised_, dofs * real, "raised"},
    };
    for (const Request& request : requests) {
        auto buffer = device_.backend->create_buffer(std::max<std::size_t>(request.bytes, 8), request.label);
        if (!buffer) return buffer.error();
        *request.buffer = std::move(*buffer);
    }
    // Fixed vertices keep 0 in the field.
    recorder_.fill(field_.ref(), 0, std::max<std::size_t>(vertices * vector, 8) / 4 * 4);
    return run();
}

Status DeviceSolver::run() {
    const Status status = device_.backend->submit(recorder_);
    recorder_.clear();
    return status ? device_.backend->wait(kTimeout_s) : status;
}

/// Runs what is recorded and reads numbers that it leaves, with one wait for both.
Result<std::vector<double>> DeviceSolver::run_and_read(const Buffer& buffer, std::size_t count) {
    const Status status = device_.backend->submit(recorder_);
    recorder_.clear();
    if (!status) return status.error();
    return device_.read_reals(buffer, count);
}

BufferRef DeviceSolver::slot(int number) const {
    return status_.ref(static_cast<std::size_t>(number) * device_.real_bytes());
}

void DeviceSolver::constrain(const Buffer& points) {
    recorder_.dispatch(device_.precision,
                       args::constrain_points{points.ref(), device_.hanging_vertex.ref(),
                                              device_.hanging_offset.ref(), device_.hanging_master.ref(),
                                              device_.hanging_weight.ref(), device_.hanging_count});
}

void DeviceSolver::reduce(bool sum, BufferRef source, std::uint32_t count, BufferRef target) {
    int next = 1;
    while (true) {
        const std::uint32_t groups = blocks(count, kReduceWidth);
        const BufferRef to = groups <= 1 ? target : partial_[next].ref();
        if (sum)
            recorder_.dispatch(device_.precision, args::reduce_sum{source, to, count, groups});
        else
            recorder_.dispatch(device_.precision, args::reduce_min{source, to, count, groups});
        if (groups <= 1) return;
        source = to;
        count = groups;
        next = 1 - next;
    }
}

void DeviceSolver::dot(const Buffer& a, const Buffer& b, BufferRef target) {
    const std::uint32_t count = blocks(device_.dof_count, kDotWidth);
    recorder_.dispatch(device_.precision,
                       args::dot_blocks{a.ref(), b.ref(), partial_[0].ref(), device_.dof_count, count});
    reduce(true, partial_[0].ref(), count, target);
}

Status DeviceSolver::update_lengths() {
    recorder_.dispatch(device_.precision, args::measure_length{device_.points.ref(), device_.cells.ref(),
                                                               device_.length.ref(), device_.cell_count});
    reduce(true, device_.length.ref(), device_.cell_count, slot(kLengthSum));
    recorder_.dispatch(device_.precision, args::invert_length{device_.length.ref(), slot(kLengthSum),
                                                              device_.inverse_length.ref(), kLengthFloorRel,
                                                              device_.cell_count});
    return run();
}

void DeviceSolver::record_energy(const Objective& o, const Buffer& points) {
    recorder_.dispatch(device_.precision,
                       args::cell_energy{points.ref(), device_.cells.ref(), device_.inverse_length.ref(),
                                         device_.cell_weight.ref(), device_.tet_mask.ref(), energy_.ref(),
                                         least_.ref(), static_cast<float>(o.eps),
                                         static_cast<float>(o.shape_weight),
                                         static_cast<float>(o.penalty_weight), static_cast<float>(o.theta),
                                         device_.cell_count});
    reduce(true, energy_.ref(), device_.cell_count, slot(kEnergy));
    reduce(false, least_.ref(), device_.cell_count, slot(kLeastJacobian));
    if (!sliders_) return;
    sliders_->limit(recorder_, points, limit_weight(o));
    reduce(true, sliders_->energy(), sliders_->count(), slot(kLimits));
}

Result<ObjectiveValue> DeviceSolver::read_value() {
    auto numbers = run_and_read(status_, kSlots);
    if (!numbers) return numbers.error();
    const double limits = sliders_ ? (*numbers)[kLimits] : 0;
    return ObjectiveValue{(*numbers)[kEnergy] + limits, (*numbers)[kLeastJacobian]};
}

Result<ObjectiveValue> DeviceSolver::evaluate(const Objective& objective) {
    record_energy(objective, device_.points);
    return read_value();
}

void DeviceSolver::record_measure() {
    recorder_.dispatch(device_.precision,
                       args::cell_quality{device_.points.ref(), device_.cells.ref(),
                                          device_.inverse_length.ref(), device_.tet_mask.ref(), energy_.ref(),
                                          least_.ref(), third_.ref(), device_.cell_count});
    reduce(false, energy_.ref(), device_.cell_count, slot(kMinSj));
    reduce(true, energy_.ref(), device_.cell_count, slot(kSumSj));
    reduce(true, least_.ref(), device_.cell_count, slot(kBad8));
    reduce(true, third_.ref(), device_.cell_count, slot(kBad32));
}

Result<DeviceQuality> DeviceSolver::read_quality() {
    auto numbers = run_and_read(status_, kSlots);
    if (!numbers) return numbers.error();
    return DeviceQuality{(*numbers)[kBad8], (*numbers)[kBad32], (*numbers)[kMinSj], (*numbers)[kSumSj]};
}

Result<DeviceQuality> DeviceSolver::measure() {
    record_measure();
    return read_quality();
}

Result<std::vector<CellMeasure>> DeviceSolver::measure_cells() {
    if (auto quality = measure(); !quality) return quality.error();
    std::vector<CellMeasure> cells(device_.cell_count);
    const auto read = [&](const Buffer& from, const auto& take) -> Status {
        auto numbers = device_.read_reals(from, cells.size());
        if (!numbers) return numbers.error();
        for (std::size_t i = 0; i < cells.size(); ++i) take(cells[i], (*numbers)[i]);
        return Done{};
    };
    Status status = read(energy_, [](CellMeasure& c, double x) { c.min_sj = static_cast<float>(x); });
    if (status) status = read(least_, [](CellMeasure& c, double x) { c.has_bad8 = x > 0; });
    if (status) status = read(third_, [](CellMeasure& c, double x) { c.has_bad32 = x > 0; });
    if (!status) return status.error();
    return cells;
}

Status DeviceSolver::sweep_newton(double eps, int sweeps, double omega, bool blocks) {
    if (sweeps > 0 && blocks)
        if (auto status = device_.find_regular_blocks(); !status) return status;
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        for (std::size_t c = 0; c < device_.colours.rows(); ++c) {
            const std::uint32_t regular = blocks ? device_.regular_count[c] : 0;
            if (blocks)
                recorder_.dispatch(
                    device_.precision,
                    args::newton_regular{
                        device_.points.ref(),
                        device_.stencil.ref(4 * RegularBlock::kNumbers * device_.regular_first[c]),
                        device_.inverse_length.ref(), device_.cell_weight.ref(), static_cast<float>(eps),
                        static_cast<float>(omega), regular});
            const std::uint32_t count = device_.free_count[c] - regular;
            recorder_.dispatch(
                device_.precision,
                args::newton_vertex{device_.points.ref(), device_.cells.ref(), device_.inverse_length.ref(),
                                    device_.cell_weight.ref(), device_.ball_offset.ref(),
                                    device_.ball_item.ref(), device_.pattern.ref(), device_.dof_vertex.ref(),
                                    device_.dof_list.ref(4 * (device_.colours.offset[c] + regular)),
                                    static_cast<float>(eps), static_cast<float>(omega), count});
            if (sliders_) sliders_->sweep_newton(recorder_, c, eps, omega, limit_weight({eps, 1, 0, 0}));
            constrain(device_.points);
        }
    }
    return run();
}

void DeviceSolver::record_raise(double margin, double gain) {
    recorder_.fill(raised_.ref(), 0, device_.dof_count * device_.real_bytes());
    for (std::size_t c = 0; c < device_.colours.rows(); ++c) {
        const std::uint32_t count = device_.free_count[c];
        recorder_.dispatch(
            device_.precision,
            args::raise_vertex{device_.points.ref(), device_.cells.ref(), device_.inverse_length.ref(),
                               device_.cell_weight.ref(), device_.ball_offset.ref(), device_.ball_item.ref(),
                               device_.pattern.ref(), device_.dof_vertex.ref(),
                               device_.dof_list.ref(4 * device_.colours.offset[c]), slot(kMinSj),
                               raised_.ref(), static_cast<float>(margin), static_cast<float>(gain), count});
        if (sliders_) sliders_->sweep_raise(recorder_, c, slot(kMinSj), raised_.ref(), margin, gain);
        constrain(device_.points);
    }
}

Result<std::size_t> DeviceSolver::sweep_raise(double margin, double gain) {
    record_raise(margin, gain);
    reduce(true, raised_.ref(), device_.dof_count, slot(kRaised));
    auto numbers = run_and_read(status_, kSlots);
    if (!numbers) return numbers.error();
    return static_cast<std::size_t>((*numbers)[kRaised]);
}

Result<DeviceQuality> DeviceSolver::raise_and_measure(double margin, double gain) {
    record_raise(margin, gain);
    record_measure();
    return read_quality();
}

Status DeviceSolver::sweep_laplacian(bool smart) {
    if (auto status = device_.find_neighbours(); !status) return status;
    for (std::size_t c = 0; c < device_.colours.rows(); ++c) {
        const auto count = static_cast<std::uint32_t>(device_.colours[c].size());
        recorder_.dispatch(device_.precision,
                           args::laplacian_vertex{device_.points.ref(), device_.cells.ref(),
                                                  device_.inverse_length.ref(), device_.cell_weight.ref(),
                                                  device_.ball_offset.ref(), device_.ball_item.ref(),
                                                  device_.pattern.ref(), device_.dof_vertex.ref(),
                                                  device_.dof_list.ref(4 * device_.colours.offset[c]),
                                                  device_.neighbour_offset.ref(), device_.neighbour.ref(),
                                                  device_.neighbour_weight.ref(), smart ? 1u : 0u, count});
        constrain(device_.points);
    }
    return run();
}

Status DeviceSolver::save() {
    recorder_.copy(device_.points.ref(), saved_.ref(), device_.vertex_count * device_.point_bytes());
    return run();
}

Status DeviceSolver::restore() {
    recorder_.copy(saved_.ref(), device_.points.ref(), device_.vertex_count * device_.point_bytes());
    return run();
}

/// product_ = matrix times direction: the Hessian model of an objective, or the graph Laplacian (null).
void DeviceSolver::record_product(const Objective* o) {
    recorder_.dispatch(device_.precision,
                       args::constrain_field{field_.ref(), device_.hanging_vertex.ref(),
                                             device_.hanging_offset.ref(), device_.hanging_master.ref(),
                                             device_.hanging_weight.ref(), device_.hanging_count});
    if (o)
        recorder_.dispatch(device_.precision,
                           args::cell_hessian_product{
                               device_.points.ref(), device_.cells.ref(), device_.inverse_length.ref(),
                               device_.cell_weight.ref(), device_.tet_mask.ref(), field_.ref(),
                               cell_vectors_.ref(), static_cast<float>(o->eps),
                               static_cast<float>(o->shape_weight), static_cast<float>(o->penalty_weight),
                               static_cast<float>(o->theta), device_.cell_count});
    else
        recorder_.dispatch(device_.precision,
                           args::cell_laplacian{device_.cells.ref(), device_.edge_weight.ref(), field_.ref(),
                                                cell_vectors_.ref(), device_.cell_count});
    recorder_.dispatch(device_.precision,
                       args::gather_cells{device_.ball_offset.ref(), device_.ball_item.ref(),
                                          device_.pattern.ref(), cell_vectors_.ref(), product_.ref(), 1.0f,
                                          device_.dof_count});
    if (o && sliders_) sliders_->restrict_product(recorder_, direction_, product_);
}

/// Solves matrix * solution_ = -gradient_ with block_ as preconditioner.
Result<int> DeviceSolver::solve(const Objective* objective, double tolerance, int max_iterations) {
    const std::size_t real = device_.real_bytes();
    const auto scalar = [&](int number) { return scalars_.ref(static_cast<std::size_t>(number) * real); };
    recorder_.dispatch(device_.precision,
                       args::cg_start{gradient_.ref(), block_.ref(), device_.dof_vertex.ref(),
                                      solution_.ref(), residual_.ref(), preconditioned_.ref(),
                                      direction_.ref(), field_.ref(), device_.dof_count});
    dot(residual_, preconditioned_, scalar(kRz));
    recorder_.copy(scalar(kRz), scalar(kFirstRz), real);
    int rz = kRz, new_rz = kOtherRz;
    for (int iteration = 0; iteration < max_iterations;) {
        for (int k = 0; k < kCgIterationsBetweenReads && iteration < max_iterations; ++k, ++iteration) {
            record_product(objective);
            dot(direction_, product_, scalar(kCurvature));
            recorder_.dispatch(device_.precision,
                               args::cg_step{direction_.ref(), product_.ref(), block_.ref(), scalar(rz),
                                             scalars_.ref(), solution_.ref(), residual_.ref(),
                                             preconditioned_.ref(), static_cast<float>(tolerance),
                                             device_.dof_count});
            dot(residual_, preconditioned_, scalar(new_rz));
            recorder_.dispatch(device_.precision,
                               args::cg_direction{preconditioned_.ref(), scalar(rz), scalar(new_rz),
                                                  device_.dof_vertex.ref(), direction_.ref(), field_.ref(),
                                                  device_.dof_count});
            std::swap(rz, new_rz);
        }
        auto numbers = run_and_read(scalars_, kCgScalars);
        if (!numbers) return numbers.error();
        if (!((*numbers)[rz] > tolerance * (*numbers)[kFirstRz])) return iteration;
    }
    return max_iterations;
}

Result<bool> DeviceSolver::search_line(const Objective& objective, double slope, ObjectiveValue& value) {
    const std::size_t bytes = device_.vertex_count * device_.point_bytes();
    double length = 1;
    for (int halving = 0; halving < kMaxHalvings; ++halving, length *= 0.5) {
        recorder_.copy(device_.points.ref(), trial_.ref(), bytes);
        recorder_.dispatch(device_.precision,
                           args::take_step{device_.points.ref(), solution_.ref(), device_.dof_vertex.ref(),
                                           trial_.ref(), static_cast<float>(length), device_.dof_count});
        if (sliders_) sliders_->project(recorder_, trial_);
        constrain(trial_);
        record_energy(objective, trial_);
        auto at = read_value();
        if (!at) return at.error();
        if (at->energy <= value.energy + kArmijo * length * slope) {
            std::swap(device_.points, trial_);
            value = *at;
            return true;
        }
    }
    return false;
}

void DeviceSolver::record_gradient(const Objective& o) {
    recorder_.dispatch(
        device_.precision,
        args::dof_gradient{device_.points.ref(), device_.cells.ref(), device_.inverse_length.ref(),
                           device_.cell_weight.ref(), device_.ball_offset.ref(), device_.ball_item.ref(),
                           device_.pattern.ref(), gradient_.ref(), block_.ref(), static_cast<float>(o.eps),
                           static_cast<float>(o.shape_weight), static_cast<float>(o.penalty_weight),
                           static_cast<float>(o.theta), device_.dof_count});
    if (sliders_) sliders_->restrict_gradient(recorder_, gradient_, block_);
}

Result<std::vector<Point>> DeviceSolver::read_gradient() {
    auto numbers = run_and_read(gradient_, 3 * std::size_t{device_.dof_count});
    if (!numbers) return numbers.error();
    std::vector<Point> gradient(device_.dof_count);
    for (std::size_t d = 0; d < gradient.size(); ++d)
        gradient[d] =
            Point((*numbers)[3 * d], (*numbers)[3 * d + 1], (*numbers)[3 * d + 2]) / device_.frame.unit;
    return gradient;
}

Result<std::vector<Point>> DeviceSolver::compute_gradient(const Objective& objective) {
    record_gradient(objective);
    return read_gradient();
}

Result<std::vector<Point>> DeviceSolver::compute_difference_gradient(Energy energy, double eps,
                                                                     double step_rel) {
    recorder_.dispatch(device_.precision,
                       args::difference_gradient{
                           device_.points.ref(), device_.cells.ref(), device_.inverse_length.ref(),
                           device_.cell_weight.ref(), device_.ball_offset.ref(), device_.ball_item.ref(),
                           device_.pattern.ref(), gradient_.ref(), static_cast<std::uint32_t>(energy),
                           static_cast<float>(eps), static_cast<float>(step_rel), device_.dof_count});
    return read_gradient();
}

Result<std::vector<double>> DeviceSolver::sweep_untangle(double box_rel) {
    if (device_.precision != compute::Precision::f64)
        return make_error(ErrorCode::usage, "compute", "untangle_vertex", "linear programs need f64");
    // Rows of a dof's program: the box's six and one a tetrahedron.
    const DofBalls balls = compute_dof_balls(*device_.problem);
    std::vector<std::uint32_t> offset;
    std::uint32_t widest = 0;
    for (std::size_t c = 0; c < device_.colours.rows(); ++c) {
        std::uint32_t rows = 0;
        for (std::uint32_t dof : device_.colours[c]) {
            offset.push_back(rows);
            rows += 6 + 32 * (balls.offset[dof + 1] - balls.offset[dof]);
        }
        widest = std::max(widest, rows);
    }
    auto offsets = compute::create_array<std::uint32_t>(*device_.backend, offset, "rows of linear programs");
    if (!offsets) return offsets.error();
    auto scratch = device_.create_reals(4 * std::size_t{widest}, "linear programs");
    if (!scratch) return scratch.error();
    for (std::size_t c = 0; c < device_.colours.rows(); ++c) {
        const std::size_t first = 4 * device_.colours.offset[c];
        recorder_.dispatch(device_.precision,
                           args::untangle_vertex{device_.points.ref(), device_.cells.ref(),
                                                 device_.inverse_length.ref(), device_.cell_weight.ref(),
                                                 device_.ball_offset.ref(), device_.ball_item.ref(),
                                                 device_.pattern.ref(), device_.dof_vertex.ref(),
                                                 device_.dof_list.ref(first), offsets->ref(first),
                                                 scratch->ref(), raised_.ref(), static_cast<float>(box_rel),
                                                 static_cast<std::uint32_t>(device_.colours[c].size())});
        constrain(device_.points);
    }
    if (auto status = run(); !status) return status.error();
    auto in_order = device_.read_reals(raised_, device_.dof_count);
    if (!in_order) return in_order.error();
    return in_order;
}

Status DeviceSolver::step_hyperelastic(double relaxation) {
    recorder_.copy(device_.points.ref(), trial_.ref(), device_.vertex_count * device_.point_bytes());
    recorder_.dispatch(device_.precision,
                       args::hyperelastic_step{device_.points.ref(), device_.cells.ref(),
                                               device_.inverse_length.ref(), device_.cell_weight.ref(),
                                               device_.ball_offset.ref(), device_.ball_item.ref(),
                                               device_.pattern.ref(), device_.dof_vertex.ref(), trial_.ref(),
                                               static_cast<float>(relaxation), device_.dof_count});
    constrain(trial_);
    const Status status = run();
    if (status) std::swap(device_.points, trial_);
    return status;
}

Result<NewtonResult> DeviceSolver::minimise(const Objective& objective, const NewtonOptions& options,
                                            const Budget& budget) {
    NewtonResult result;
    if (sliders_) {
        // Only for the directions here; later ones come with each trial that is accepted.
        recorder_.copy(device_.points.ref(), trial_.ref(), device_.vertex_count * device_.point_bytes());
        sliders_->project(recorder_, trial_);
    }
    auto value = evaluate(objective);
    if (!value) return value.error();
    result.start = *value;
    while (result.steps < options.max_steps && device_.dof_count > 0 && !budget.exhausted()) {
        record_gradient(objective);
        auto iterations = solve(&objective, options.cg_tolerance, options.cg_max_iterations);
        if (!iterations) return iterations.error();
        result.cg_iterations += *iterations;
        dot(gradient_, solution_, slot(kSlope));
        auto numbers = run_and_read(status_, kSlots);
        if (!numbers) return numbers.error();
        const double slope = (*numbers)[kSlope], before = value->energy;
        auto moved = slope < 0 ? search_line(objective, slope, *value) : Result<bool>(false);
        if (!moved) return moved.error();
        if (!*moved) {
            result.stalled = true;
            break;
        }
        ++result.steps;
        if (before - value->energy < options.min_relative_decrease * std::abs(before)) break;
    }
    result.end = *value;
    return result;
}

Result<int> DeviceSolver::harmonic_start(double tolerance, int max_iterations) {
    recorder_.dispatch(device_.precision, args::cell_umbrella{device_.points.ref(), device_.cells.ref(),
                                                              device_.edge_weight.ref(), cell_vectors_.ref(),
                                                              device_.cell_count});
    recorder_.dispatch(device_.precision,
                       args::gather_cells{device_.ball_offset.ref(), device_.ball_item.ref(),
                                          device_.pattern.ref(), cell_vectors_.ref(), gradient_.ref(), 1.0f,
                                          device_.dof_count});
    recorder_.dispatch(device_.precision,
                       args::laplacian_blocks{device_.edge_weight.ref(), device_.ball_offset.ref(),
                                              device_.ball_item.ref(), device_.pattern.ref(), block_.ref(),
                                              device_.dof_count});
    auto iterations = solve(nullptr, tolerance, max_iterations);
    if (!iterations) return iterations.error();
    recorder_.copy(device_.points.ref(), trial_.ref(), device_.vertex_count * device_.point_bytes());
    recorder_.dispatch(device_.precision,
                       args::take_step{device_.points.ref(), solution_.ref(), device_.dof_vertex.ref(),
                                       trial_.ref(), 1.0f, device_.dof_count});
    constrain(trial_);
    if (auto status = run(); !status) return status.error();
    std::swap(device_.points, trial_);
    return iterations;
}

} // namespace hexopt
