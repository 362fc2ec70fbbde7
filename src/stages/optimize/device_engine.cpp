#include "stages/optimize/device_engine.hpp"

#include "stages/optimize/device_solver.hpp"

#include <fmt/format.h>

namespace hexopt {

using compute::Backend;
using compute::DeviceType;
using compute::Precision;

namespace {

/// A software device computes on the host's cores, without its vectorised kernels and assembled matrix.
constexpr double kSoftwareSpeed = 0.05;
constexpr double kRaiseMargin = 0.05, kRaiseGain = 0.03;
constexpr double kWorthwhileRise = 1e-4;
constexpr int kMaxIdleSweeps = 10, kMaxRaiseSweeps = 200;
constexpr int kHarmonicIterations = 200;
constexpr double kHarmonicTolerance = 1e-8;

} // namespace

/// A problem on the engine's backend, made anew where that has changed.
class DeviceMinimiser final : public Minimiser {
  public:
    DeviceMinimiser(DeviceEngine& engine, Problem& problem, std::vector<Point>& positions,
                    const SurfaceMotion* motion)
        : engine_(engine), problem_(problem), positions_(positions), motion_(motion) {
        if (motion) slides_ = DeviceSliders::find(problem, motion->surface());
    }

    const Problem& problem() const override { return problem_; }

    Resolution resolution() const override {
        if (engine_.target_.precision == Precision::f64) return {};
        return {1e-6, 1e-7};
    }

    void update_lengths() override {
        measured_at_ = positions_;
        if (solver_) run([](DeviceSolver& solver) { return solver.update_lengths(); });
    }

    ObjectiveValue evaluate(const Objective& objective) override {
        ObjectiveValue value;
        run([&](DeviceSolver& solver) { return take(value, solver.evaluate(objective)); });
        return value;
    }

    NewtonResult minimise(const Objective& objective, const NewtonOptions& options) override {
        NewtonResult result;
        result.stalled = true; // where nothing can be computed any more
        const int sweeps = objective.penalty_weight > 0 ? 0 : engine_.target_.sweeps_per_round;
        run([&](DeviceSolver& solver) -> Status {
            const auto start = solver.evaluate(objective);
            if (!start) return start.error();
            if (Status s = solver.sweep_newton(objective.eps, sweeps); !s) return s;
            if (Status s = take(result, solver.minimise(objective, options, engine_.budget_)); !s) return s;
            result.start = *start;
            return device_->download_positions(next_);
        });
        accept();
        for (int i = 0; i < result.steps + sweeps; ++i) engine_.budget_.spend_iteration();
        return result;
    }

    int start_harmonically(std::span<const std::uint8_t>) override {
        int iterations = 0;
        run([&](DeviceSolver& solver) -> Status {
            if (Status s = take(iterations, solver.harmonic_start(kHarmonicTolerance, kHarmonicIterations));
                !s)
                return s;
            return device_->download_positions(next_);
        });
        accept();
        return iterations;
    }

    std::vector<CellMeasure> measure() override {
        std::vector<CellMeasure> cells;
        run([&](DeviceSolver& solver) { return take(cells, solver.measure_cells()); });
        return cells;
    }

    int raise_vertices(double target) override {
        int sweeps = 0;
        run([&](DeviceSolver& solver) -> Status {
            const int most = std::min(kMaxRaiseSweeps, engine_.budget_.iterations_left());
            int idle = sweeps = 0;
            DeviceQuality quality;
            if (Status s = take(quality, solver.measure()); !s) return s;
            while (sweeps < most && idle < kMaxIdleSweeps && quality.min_sj < target &&
                   !engine_.budget_.exhausted()) {
                const double before = quality.min_sj;
                if (Status s = take(quality, solver.raise_and_measure(kRaiseMargin, kRaiseGain)); !s)
                    return s;
                ++sweeps;
                idle = quality.min_sj > before + kWorthwhileRise ? 0 : idle + 1;
            }
            return sweeps > 0 ? device_->download_positions(next_) : Status(Done{});
        });
        if (sweeps == 0) return 0;
        accept();
        for (int i = 0; i < sweeps; ++i) engine_.budget_.spend_iteration();
        return sweeps;
    }

  private:
    template <class T>
    static Status take(T& to, Result<T> result) {
        if (!result) return result.error();
        to = std::move(*result);
        return Done{};
    }

    /// Does a step, which may be begun more than once: on the device and, if that fails, on the host.
    template <class Step>
    void run(const Step& step) {
        while (engine_.status_) {
            Status status = begin();
            if (status) status = step(*solver_);
            if (status) return;
            close();
            if (!engine_.move_to_host(status.error())) engine_.status_ = status;
        }
    }

    /// The current positions on the backend, at the target sizes measured last.
    Status begin() {
        next_ = positions_;
        if (opened_on_ != engine_.backend_) {
            close();
            if (Status s = open(); !s) return s;
            if (Status s = device_->upload_positions(measured_at_); !s) return s;
            if (Status s = solver_->update_lengths(); !s) return s;
            opened_on_ = engine_.backend_;
        }
        if (Status s = device_->upload_positions(positions_); !s) return s;
        return sliders_ ? sliders_->upload(motion_->limits(), positions_, engine_.budget_.parallel())
                        : Status(Done{});
    }

    Status open() {
        auto device = DeviceProblem::create(*engine_.backend_, engine_.target_.precision, problem_,
                                            engine_.frame_, slides_, engine_.budget_.parallel());
        if (!device) return device.error();
        device_ = std::make_unique<DeviceProblem>(std::move(*device));
        if (motion_) {
            auto surface = engine_.surface_on_backend();
            if (!surface) return surface.error();
            auto sliders = DeviceSliders::create(*device_, **surface, motion_->surface());
            if (!sliders) return sliders.error();
            sliders_ = std::make_unique<DeviceSliders>(std::move(*sliders));
        }
        return take(solver_, DeviceSolver::create(*device_, sliders_.get()));
    }

    void close() {
        solver_.reset();
        sliders_.reset();
        device_.reset();
        opened_on_ = nullptr;
    }

    /// Takes over what the device has made of the positions. Vertices on the surface are put onto it again,
    /// since f32 keeps them there to seven digits only.
    void accept() {
        if (!engine_.status_) return;
        if (motion_ && engine_.target_.precision == Precision::f32)
            for (Index d = 0; d < problem_.dof_count(); ++d)
                next_[problem_.dof_vertex()[d]] = motion_->place(d, next_[problem_.dof_vertex()[d]]);
        positions_.swap(next_);
        problem_.apply_hanging(positions_);
    }

    DeviceEngine& engine_;
    Problem& problem_;
    std::vector<Point>& positions_;
    const SurfaceMotion* motion_;
    std::vector<std::uint8_t> slides_;
    std::vector<Point> measured_at_; ///< where target sizes were measured
    std::vector<Point> next_;        ///< what a step has got to
    Backend* opened_on_ = nullptr;
    std::unique_ptr<DeviceProblem> device_;
    std::unique_ptr<DeviceSliders> sliders_;
    std::unique_ptr<DeviceSolver> solver_;
};

DeviceEngine::DeviceEngine(const HexMesh& mesh, const BoundaryModel* surface, const DeviceTarget& target,
                           std::span<const Point> positions, Budget& budget, std::vector<std::string>& notes)
    : model_(surface), target_(target), budget_(budget), notes_(notes), backend_(target.backend) {
    frame_ = DeviceFrame::of(mesh, positions, target.precision);
    const DeviceType type = backend_->capabilities().type;
    if (type == DeviceType::software_gpu || type == DeviceType::host) speed_ = kSoftwareSpeed;
}

DeviceEngine::~DeviceEngine() = default;

std::unique_ptr<Minimiser> DeviceEngine::open(Problem& problem, std::vector<Point>& positions,
                                              const SurfaceMotion* motion) {
    return std::make_unique<DeviceMinimiser>(*this, problem, positions, motion);
}

bool DeviceEngine::move_to_host(const Error& error) {
    const bool recoverable = error.code == ErrorCode::device || error.code == ErrorCode::out_of_memory;
    if (host_ || !recoverable) return false;
    surface_.reset();
    host_ = compute::create_cpu_backend(budget_.parallel());
    backend_ = host_.get();
    const std::string note = error.one_line() + "; went on on the CPU from the last good state";
    notes_.push_back(note);
    budget_.context().log(LogLevel::warning, note);
    return true;
}

Result<const DeviceSurface*> DeviceEngine::surface_on_backend() {
    if (!surface_) {
        auto made = DeviceSurface::create(*backend_, target_.precision, frame_, *model_);
        if (!made) return made.error();
        surface_ = std::make_unique<DeviceSurface>(std::move(*made));
    }
    return surface_.get();
}

} // namespace hexopt
