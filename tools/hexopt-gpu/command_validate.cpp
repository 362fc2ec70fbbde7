#include "command.hpp"
#include "compute/device_choice.hpp"
#include "load_mesh.hpp"
#include "stages/optimize/device_validation.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace hexopt::cli {

namespace {

using namespace hexopt::compute;

struct ValidateCommand {
    std::string mesh;
    std::string device = "vulkan";
    std::string precision = "all";
    bool shuffled = false;
};

std::vector<Precision> precisions_of(const std::string& name, const Capabilities& device) {
    std::vector<Precision> list;
    for (Precision p : {Precision::f32, Precision::f64, Precision::mixed})
        if ((name == "all" && device.supports(p)) || name == name_of(p)) list.push_back(p);
    return list;
}

void say_difference(const KernelDifference& d, Session& session) {
    session.say(fmt::format(
        "{:<22} {:<5} {:>5} dispatches {:>8} numbers differ, largest {:.2e}, bound {:.2e}", d.kernel->name,
        name_of(d.precision), d.dispatches, d.different_words, d.largest_rel, d.bound()));
}

/// All kernels on one mesh; false where a result is out of bounds.
Result<bool> validate(const LoadedMesh& loaded, Backend& tested, const ValidateCommand& options,
                      Session& session) {
    Context& context = session.context();
    const auto& on_boundary = loaded.topology.on_boundary;
    if (std::all_of(on_boundary.begin(), on_boundary.end(), [](auto on) { return on != 0; }))
        return make_error(ErrorCode::bad_input, "validate", options.mesh,
                          "every vertex lies on the boundary; take a mesh with inner vertices");
    const auto surface = build_boundary_model(loaded.mesh, loaded.topology, {}, context);
    if (!surface) return surface.error();
    const auto cpu = create_cpu_backend(context.parallel(), CpuOrder::scalar);
    const Budget budget(OptimizeOptions{}, context);
    bool within = true;
    for (Precision precision : precisions_of(options.precision, tested.capabilities())) {
        if (context.is_cancelled()) return make_error(ErrorCode::cancelled, "validate", "", "cancelled");
        const auto list =
            validate_device(*cpu, tested, precision, loaded.mesh, loaded.topology, *surface, budget);
        if (!list) return list.error();
        for (const KernelDifference& d : *list) say_difference(d, session);
        within = within && is_within_bounds(*list, tested.capabilities().type);
    }
    return within;
}

void run(const ValidateCommand& options, Session& session) {
    Context& context = session.context();
    auto opened = open_device(options.device, options.precision == "f32" ? Precision::f32 : Precision::f64);
    if (!opened) return session.fail(opened.error());
    if (options.shuffled && opened->backend)
        return session.fail(make_error(ErrorCode::usage, "validate", "--shuffled",
                                       "shuffles what the host computes; give it with --device cpu"));
    std::unique_ptr<Backend> backend = std::move(opened->backend);
    if (!backend)
        backend = create_cpu_backend(context.parallel(),
                                     options.shuffled ? CpuOrder::shuffled : CpuOrder::parallel);
    session.say(fmt::format("reference: cpu, scalar kernels, {} thread{}; tested: {}",
                            context.parallel().threads(), context.parallel().threads() == 1 ? "" : "s",
                            opened->choice.reason));
    const auto loaded = load_mesh(options.mesh, context);
    if (!loaded) return session.fail(loaded.error());
    const auto within = validate(*loaded, *backend, options, session);
    if (!within) return session.fail(within.error());
    if (!*within)
        return session.fail(make_error(ErrorCode::device, "validate", backend->capabilities().name,
                                       "results are out of bounds; update the driver or use --device cpu"));
    session.say(backend->capabilities().type == DeviceType::software_gpu
                    ? "all results are equal, bit for bit"
                    : "all results are within their bounds");
}

} // namespace

void add_validate(CLI::App& app, Session& session) {
    CLI::App* command =
        app.add_subcommand("validate", "Run every kernel on the CPU and on a device, and compare");
    const auto options = std::make_shared<ValidateCommand>();
    command->add_option("mesh", options->mesh, "Mesh to run them on: .vtk, .vtu, .mesh or .msh")
        ->required()
        ->type_name("MESH");
    command->add_option("--device", options->device, "auto, cpu, vulkan, or the index or name of a device")
        ->type_name("DEVICE")
        ->capture_default_str();
    command->add_option("--precision", options->precision, "Which variants of the kernels")
        ->check(CLI::IsMember({"all", "f32", "f64", "mixed"}))
        ->capture_default_str();
    command->add_flag("--shuffled", options->shuffled,
                      "With --device cpu: work items in a random order, which shows races");
    session.add_common_options(*command);
    command->callback([options, &session] { run(*options, session); });
}

} // namespace hexopt::cli
