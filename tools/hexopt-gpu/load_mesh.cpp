#include "load_mesh.hpp"

#include "io/mesh_io.hpp"
#include "mesh/recognise_hanging.hpp"

#include <fmt/format.h>

namespace hexopt::cli {

namespace {

Status recognise(HexMesh& mesh, const std::filesystem::path& path, Context& context) {
    Result<RecognisedHanging> found = recognise_hanging(mesh, {}, context.parallel());
    if (!found) return found.error();
    if (found->conflict_count > 0)
        context.log(LogLevel::warning,
                    fmt::format("{}: {} hanging vertices have two places where they could belong",
                                path.string(), found->conflict_count));
    if (!found->hanging.empty())
        context.log(LogLevel::info,
                    fmt::format("{}: recognised {} hanging vertices on {} coarse faces", path.string(),
                                found->hanging.count(), found->coarse_face_count));
    mesh.hanging = std::move(found->hanging);
    return Done{};
}

} // namespace

Result<LoadedMesh> load_mesh(const std::filesystem::path& path, Context& context) {
    Result<HexMesh> mesh = read_mesh(path, context);
    if (!mesh) return mesh.error();
    if (mesh->hanging.empty())
        if (const Status status = recognise(*mesh, path, context); !status) return status.error();
    Topology topology = compute_topology(*mesh, context.parallel());
    return LoadedMesh{std::move(*mesh), std::move(topology)};
}

} // namespace hexopt::cli
