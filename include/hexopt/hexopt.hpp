/// hexopt: meshes surfaces; untangles and improves hexahedral meshes. C++20 interface, header-only over
/// hexopt.h, so that the library's binary interface stays the C one. See hexopt.h for what each field means.
#ifndef HEXOPT_HPP
#define HEXOPT_HPP

#include "hexopt/hexopt.h"

#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hexopt::inline v1 {

/// A call that left no result; what() says why, where, and what to do.
class Failure : public std::runtime_error {
  public:
    Failure(hexopt_status status, const std::string& message)
        : std::runtime_error(message), status_(status) {}
    hexopt_status status() const { return status_; }

  private:
    hexopt_status status_;
};

/// A mesh in the caller's arrays, as hexopt_mesh describes; only positions are ever written to.
struct Mesh {
    std::span<double> positions;          ///< x, y, z of vertex 0, 1, ...
    std::span<const std::uint32_t> cells; ///< 8 vertex numbers a cell, in VTK order

    std::span<const std::uint32_t> hanging_vertex = {};
    std::span<const std::uint64_t> hanging_offset = {}; ///< hanging_vertex.size() + 1; empty if none hangs
    std::span<const std::uint32_t> hanging_master = {};
    std::span<const double> hanging_weight = {};

    std::span<const std::uint32_t> patch_quads = {}; ///< 4 vertex numbers a quad
    std::span<const std::uint32_t> quad_patch = {};
};

/// Triangles that the boundary slides on, as hexopt_surface describes.
struct Surface {
    std::span<const double> positions;                  ///< x, y, z of vertex 0, 1, ...
    std::span<const std::uint32_t> triangles;           ///< 3 vertex numbers each
    std::span<const std::uint32_t> triangle_patch = {}; ///< one each, or empty
};

/// Initialised to the defaults; the fields are described in hexopt.h.
struct OptimizeOptions : hexopt_optimize_options {
    OptimizeOptions() : hexopt_optimize_options(HEXOPT_OPTIMIZE_OPTIONS_INIT) {}
};

struct OptimizeResult : hexopt_optimize_result {
    /// HEXOPT_OK, HEXOPT_NO_VALID_MESH, HEXOPT_BELOW_TARGET or HEXOPT_CANCELLED: in each of these positions
    /// hold the best state reached.
    hexopt_status status = HEXOPT_OK;
    std::string message; ///< empty with HEXOPT_OK
};

/// A mesh that was made, in arrays of its own, as hexopt_mesh describes.
struct Volume {
    std::vector<double> positions;
    std::vector<std::uint32_t> cells;
    std::vector<std::uint8_t> level; ///< of each cell
    std::vector<std::uint32_t> hanging_vertex, hanging_master;
    std::vector<std::uint64_t> hanging_offset; ///< empty if none hangs
    std::vector<double> hanging_weight;
    std::vector<std::uint32_t> patch_quads, quad_patch; ///< of all boundary quads
    std::vector<std::string> patch_names;               ///< as hexopt_volume_patch_name()

    /// For Optimizer::optimize() and measure(); valid while the volume is neither changed nor moved.
    Mesh mesh() {
        return {positions,      cells,          hanging_vertex, hanging_offset,
                hanging_master, hanging_weight, patch_quads,    quad_patch};
    }
};

struct MeshResult : hexopt_mesh_result {
    /// HEXOPT_OK, HEXOPT_NO_VALID_MESH, HEXOPT_BELOW_TARGET or HEXOPT_CANCELLED: then volume is the best
    /// state reached, empty where there was none yet.
    hexopt_status status = HEXOPT_OK;
    std::string message; ///< empty with HEXOPT_OK
    Volume volume;
};

struct Options {
    int threads = 0; ///< 0: all cores
    std::uint64_t seed = 1;
    std::function<void(hexopt_log_level, std::string_view message)> log = nullptr;
    /// Return false to cancel. fraction: 0..1, never decreasing.
    std::function<bool(std::string_view stage, double fraction, std::string_view detail)> progress = nullptr;
};

/// Runs one call at a time; any number of optimizers may be used at once from different threads. What a
/// callback throws ends the call and is thrown again from it.
class Optimizer {
  public:
    explicit Optimizer(Options options = {}) : state_(std::make_unique<State>(std::move(options))) {
        hexopt_context_options c = HEXOPT_CONTEXT_OPTIONS_INIT;
        c.threads = state_->options.threads;
        c.seed = state_->options.seed;
        c.user = state_.get();
        if (state_->options.log) c.log = &on_log;
        if (state_->options.progress) c.progress = &on_progress;
        hexopt_context* context = nullptr;
        const hexopt_status status = hexopt_context_create(&c, &context);
        if (status != HEXOPT_OK) throw Failure(status, "hexopt_context_create: check threads");
        context_.reset(context);
    }

    /// Ends the call under way, and no other, at its next safe point. From any thread.
    void cancel() noexcept { hexopt_context_cancel(context_.get()); }

    /// Moves mesh.positions; never worse than the input. Failure: the positions are as they were.
    /// surface: null for the mesh's own boundary.
    OptimizeResult optimize(const Mesh& mesh, const OptimizeOptions& options = {},
                            const Surface* surface = nullptr) {
        hexopt_mesh view = view_of(mesh);
        hexopt_surface surface_view = HEXOPT_SURFACE_INIT;
        if (surface) surface_view = view_of(*surface);
        OptimizeResult result;
        static_cast<hexopt_optimize_result&>(result) = HEXOPT_OPTIMIZE_RESULT_INIT;
        result.status = finish(
            hexopt_optimize(context_.get(), &view, surface ? &surface_view : nullptr, &options, &result));
        result.message = hexopt_context_message(context_.get());
        return result;
    }

    /// Meshes what a surface encloses. config: TOML with the keys of `hexopt-gpu mesh --dump-config`.
    MeshResult mesh(const Surface& surface, const std::string& config = {}) {
        const hexopt_surface view = view_of(surface);
        MeshResult result;
        static_cast<hexopt_mesh_result&>(result) = HEXOPT_MESH_RESULT_INIT;
        hexopt_volume* made = nullptr;
        const hexopt_status status =
            hexopt_mesh_surface(context_.get(), &view, config.c_str(), &made, &result);
        const std::unique_ptr<hexopt_volume, decltype(&hexopt_volume_destroy)> owner(made,
                                                                                     &hexopt_volume_destroy);
        result.status = finish(status);
        result.message = hexopt_context_message(context_.get());
        if (made) result.volume = copy_of(made);
        return result;
    }

    /// Validity and quality; positions are only read.
    hexopt_quality measure(const Mesh& mesh) {
        const hexopt_mesh view = view_of(mesh);
        hexopt_quality quality = HEXOPT_QUALITY_INIT;
        finish(hexopt_measure(context_.get(), &view, &quality));
        return quality;
    }

  private:
    struct State {
        explicit State(Options o) : options(std::move(o)) {}
        Options options;
        std::exception_ptr thrown;
    };
    struct Destroy {
        void operator()(hexopt_context* context) const { hexopt_context_destroy(context); }
    };

    static hexopt_mesh view_of(const Mesh& mesh) {
        const auto require = [](bool holds, const char* what) {
            if (!holds) throw Failure(HEXOPT_USAGE, std::string("hexopt::Mesh: ") + what);
        };
        require(mesh.positions.size() % 3 == 0, "positions must have 3 entries a vertex");
        require(mesh.cells.size() % 8 == 0, "cells must have 8 entries each");
        require(mesh.hanging_offset.size() ==
                    (mesh.hanging_vertex.empty() ? 0 : mesh.hanging_vertex.size() + 1),
                "hanging_offset must have one entry more than hanging_vertex");
        require(mesh.hanging_vertex.empty() || (mesh.hanging_master.size() == mesh.hanging_offset.back() &&
                                                mesh.hanging_weight.size() == mesh.hanging_offset.back()),
                "hanging_master and hanging_weight must end where hanging_offset does");
        require(mesh.patch_quads.size() == 4 * mesh.quad_patch.size(),
                "patch_quads must have 4 entries a quad");
        hexopt_mesh view = HEXOPT_MESH_INIT;
        view.vertex_count = mesh.positions.size() / 3;
        view.positions = mesh.positions.data();
        view.cell_count = mesh.cells.size() / 8;
        view.cells = mesh.cells.data();
        view.hanging_count = mesh.hanging_vertex.size();
        view.hanging_vertex = mesh.hanging_vertex.data();
        view.hanging_offset = mesh.hanging_offset.data();
        view.hanging_master = mesh.hanging_master.data();
        view.hanging_weight = mesh.hanging_weight.data();
        view.patch_quad_count = mesh.quad_patch.size();
        view.patch_quads = mesh.patch_quads.data();
        view.quad_patch = mesh.quad_patch.data();
        return view;
    }

    static Volume copy_of(hexopt_volume* made) {
        const hexopt_mesh mesh = hexopt_volume_mesh(made);
        Volume volume;
        volume.positions.assign(mesh.positions, mesh.positions + 3 * mesh.vertex_count);
        volume.cells.assign(mesh.cells, mesh.cells + 8 * mesh.cell_count);
        volume.level.assign(hexopt_volume_level(made), hexopt_volume_level(made) + mesh.cell_count);
        if (mesh.hanging_count > 0) {
            const std::size_t entries = mesh.hanging_offset[mesh.hanging_count];
            volume.hanging_vertex.assign(mesh.hanging_vertex, mesh.hanging_vertex + mesh.hanging_count);
            volume.hanging_offset.assign(mesh.hanging_offset, mesh.hanging_offset + mesh.hanging_count + 1);
            volume.hanging_master.assign(mesh.hanging_master, mesh.hanging_master + entries);
            volume.hanging_weight.assign(mesh.hanging_weight, mesh.hanging_weight + entries);
        }
        volume.patch_quads.assign(mesh.patch_quads, mesh.patch_quads + 4 * mesh.patch_quad_count);
        volume.quad_patch.assign(mesh.quad_patch, mesh.quad_patch + mesh.patch_quad_count);
        for (std::uint32_t p = 0; p < hexopt_volume_patch_count(made); ++p)
            volume.patch_names.emplace_back(hexopt_volume_patch_name(made, p));
        return volume;
    }

    static hexopt_surface view_of(const Surface& surface) {
        if (surface.positions.size() % 3 != 0 || surface.triangles.size() % 3 != 0 ||
            (!surface.triangle_patch.empty() &&
             surface.triangle_patch.size() != surface.triangles.size() / 3))
            throw Failure(HEXOPT_USAGE, "hexopt::Surface: the sizes of the arrays do not fit");
        hexopt_surface view = HEXOPT_SURFACE_INIT;
        view.vertex_count = surface.positions.size() / 3;
        view.positions = surface.positions.data();
        view.triangle_count = surface.triangles.size() / 3;
        view.triangles = surface.triangles.data();
        view.triangle_patch = surface.triangle_patch.empty() ? nullptr : surface.triangle_patch.data();
        return view;
    }

    /// Throws what a callback threw, or a Failure where the call left no result.
    hexopt_status finish(hexopt_status status) {
        if (state_->thrown) std::rethrow_exception(std::exchange(state_->thrown, nullptr));
        if (status == HEXOPT_OK || status == HEXOPT_NO_VALID_MESH || status == HEXOPT_BELOW_TARGET ||
            status == HEXOPT_CANCELLED)
            return status;
        throw Failure(status, hexopt_context_message(context_.get()));
    }

    static void on_log(void* user, hexopt_log_level level, const char* message) noexcept {
        State& state = *static_cast<State*>(user);
        try {
            if (!state.thrown) state.options.log(level, message);
        } catch (...) {
            state.thrown = std::current_exception();
        }
    }
    static int on_progress(void* user, const char* stage, double fraction, const char* detail) noexcept {
        State& state = *static_cast<State*>(user);
        try {
            return state.thrown || !state.options.progress(stage, fraction, detail);
        } catch (...) {
            state.thrown = std::current_exception();
            return 1;
        }
    }

    std::unique_ptr<State> state_;
    std::unique_ptr<hexopt_context, Destroy> context_;
};

} // namespace hexopt::inline v1

#endif
