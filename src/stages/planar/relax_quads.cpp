#include "stages/planar/relax_quads.hpp"

#include "stages/planar/quad_motion.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace hexopt {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kChunk = 64;
constexpr int kRaiseSweeps = 40;
/// Parts of the sweeps at which the power of the energy rises, and to what.
constexpr std::array<std::pair<double, int>, 3> kPowers = {{{0.0, 1}, {0.6, 2}, {0.8, 4}}};

class Relaxation {
  public:
    Relaxation(QuadMesh& mesh, const OutlineCurves& curves, const RelaxOptions& options, Context& context)
        : mesh_(mesh), options_(options), context_(context), motion_(mesh, curves),
          awake_(mesh.positions.size(), 0), stirred_(mesh.positions.size(), 0) {}

    Result<RelaxReport> run() {
        report_.before = measure_quads(mesh_, context_.parallel());
        int sweep = 0;
        for (std::size_t stage = 0; stage < kPowers.size(); ++stage) {
            const double end = stage + 1 < kPowers.size() ? kPowers[stage + 1].first : 1;
            wake_walls();
            for (; sweep < end * options_.sweeps && !is_over(); ++sweep)
                if (!step(kPowers[stage].second)) break;
            sweep = std::max(sweep, static_cast<int>(end * options_.sweeps));
        }
        if (options_.max_min && !is_over()) raise();
        report_.after = measure_quads(mesh_, context_.parallel());
        if (context_.is_cancelled()) return make_error(ErrorCode::cancelled, "relax", "", "cancelled");
        return report_;
    }

  private:
    bool is_over() {
        const std::chrono::duration<double> spent = Clock::now() - start_;
        report_.out_of_time = report_.out_of_time || spent.count() > options_.time_limit_s;
        return report_.out_of_time || context_.is_cancelled();
    }

    void wake(Index v) {
        for (Index q : motion_.quads(v))
            for (Index u : mesh_.quads[q]) awake_[u] = 1;
    }
    void wake_walls() {
        for (const QuadMesh::WallEdge& edge : mesh_.wall) wake(edge.a);
        for (Index v : mesh_.hanging.vertex) wake(v);
    }

    /// Moves what is awake, colour by colour; false where nothing was.
    template <class Move>
    bool sweep(const Move& move) {
        std::fill(stirred_.begin(), stirred_.end(), 0);
        std::vector<Index> now;
        bool any = false;
        for (std::size_t c = 0; c < motion_.colours().rows(); ++c) {
            now.clear();
            for (Index v : motion_.colours()[c])
                if (awake_[v]) now.push_back(v);
            context_.parallel().for_each(now.size(), kChunk,
                                         [&](std::size_t i) { stirred_[now[i]] = move(now[i]); });
            any = any || !now.empty();
            report_.moves += now.size();
        }
        std::fill(awake_.begin(), awake_.end(), 0);
        for (Index v = 0; v < stirred_.size(); ++v)
            if (stirred_[v]) wake(v);
        ++report_.sweeps;
        context_.report("optimize", std::min(1.0, report_.sweeps / double(options_.sweeps + kRaiseSweeps)));
        return any;
    }

    bool step(int power) {
        const double worst = motion_.smallest_determinant(context_.parallel());
        const double epsilon = worst > 1e-3 ? 1e-6 : std::sqrt(1e-6 + 0.04 * worst * worst) + 0.02;
        const QuadEnergy energy = {epsilon, power};
        return sweep([&](Index v) { return motion_.improve(v, energy) > options_.still; });
    }

    /// The vertices of bad quads, while that helps.
    void raise() {
        for (int i = 0; i < kRaiseSweeps && !is_over(); ++i) {
            std::fill(awake_.begin(), awake_.end(), 0);
            for (std::size_t q = 0; q < mesh_.quads.size(); ++q)
                if (quad_scaled_jacobian(mesh_, q) < options_.raise_below)
                    for (Index v : mesh_.quads[q]) awake_[v] = 1;
            std::atomic<bool> moved = false;
            const bool any = sweep([&](Index v) {
                if (motion_.raise_worst(v) > 0) moved = true;
                return false;
            });
            if (!any || !moved) break;
        }
    }

    QuadMesh& mesh_;
    const RelaxOptions& options_;
    Context& context_;
    QuadMotion motion_;
    std::vector<std::uint8_t> awake_, stirred_;
    RelaxReport report_;
    Clock::time_point start_ = Clock::now();
};

} // namespace

Result<RelaxReport> relax_quads(QuadMesh& mesh, const OutlineCurves& curves, const RelaxOptions& options,
                                Context& context) {
    return Relaxation(mesh, curves, options, context).run();
}

} // namespace hexopt
