#include "stages/optimize/device_driver.hpp"

#include "stages/optimize/device_engine.hpp"
#include "stages/optimize/robust.hpp"

namespace hexopt {

Status optimize_on_device(const HexMesh& mesh, const Topology& topology, const BoundaryModel* surface,
                          const OptimizeOptions& options, const DeviceTarget& target,
                          std::vector<Point>& positions, Budget& budget,
                          const std::function<void()>& keep_if_better, OptimizeStats& stats) {
    DeviceEngine engine(mesh, surface, target, positions, budget, stats.notes);
    optimize_robust(mesh, topology, surface, options, engine, positions, budget, keep_if_better, stats);
    return engine.status();
}

} // namespace hexopt
