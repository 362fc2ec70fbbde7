#include "pipeline/run_identity.hpp"

#include "core/digest.hpp"
#include "io/file_bytes.hpp"
#include "pipeline/mesh_keys.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace hexopt {

namespace {

std::string to_text(const ConfigValue& value) {
    return std::visit(
        [](const auto& v) -> std::string {
            using T = std::decay_t<decltype(v)>;
            if constexpr (std::is_same_v<T, bool> || std::is_same_v<T, double> ||
                          std::is_same_v<T, std::string>)
                return fmt::format("{}", v);
            else
                return fmt::format("{}", fmt::join(v, "; "));
        },
        value);
}

/// Patches are named after files, so the name counts; the folder does not.
Status add_file(RunIdentity& identity, const std::string& what, const std::filesystem::path& path,
                Context& context) {
    const Result<FileBytes> bytes = read_file(path, context);
    if (!bytes) return bytes.error();
    identity.emplace_back(what, fmt::format("{}, {} bytes with digest {:016x}", path.filename().string(),
                                            bytes->view().size(), Digest().add(bytes->view()).value()));
    return Done{};
}

std::string quoted(const std::string& value) { return value.empty() ? std::string("not given") : value; }

} // namespace

Result<RunIdentity> identify_run(const MeshJob& job, Context& context) {
    RunIdentity identity = {{"program", HEXOPT_VERSION_STRING}, {"seed", fmt::format("{}", context.seed())}};
    for (std::size_t i = 0; i < job.surfaces.size(); ++i)
        if (Status done = add_file(identity, fmt::format("surface {}", i + 1), job.surfaces[i], context);
            !done)
            return done.error();
    for (std::size_t i = 0; i < job.feature_files.size(); ++i)
        if (Status done =
                add_file(identity, fmt::format("feature file {}", i + 1), job.feature_files[i], context);
            !done)
            return done.error();
    if (!job.initial_mesh.empty())
        if (Status done = add_file(identity, "initial mesh", job.initial_mesh, context); !done)
            return done.error();
    const auto& regions = job.options.refine.regions;
    for (std::size_t i = 0; i < regions.size(); ++i)
        if (!regions[i].file.empty())
            if (Status done =
                    add_file(identity, fmt::format("file of region {}", i + 1), regions[i].file, context);
                !done)
                return done.error();
    for (const MeshKey& key : mesh_keys())
        if (!key.name.starts_with("output.") && key.name != "features.lines" &&
            key.name != "refine.initial_mesh")
            identity.emplace_back(key.name, to_text(key.get(job)));
    for (const PatchTarget& patch : job.options.refine.patches)
        identity.emplace_back("patches." + patch.patch, patch.target.level >= 0
                                                            ? fmt::format("level {}", patch.target.level)
                                                            : fmt::format("size {}", patch.target.size));
    return identity;
}

std::string describe_difference(const RunIdentity& before, const RunIdentity& now) {
    const auto value_in = [](const RunIdentity& identity, const std::string& name) {
        const auto found = std::find_if(identity.begin(), identity.end(),
                                        [&](const auto& entry) { return entry.first == name; });
        return found == identity.end() ? std::string() : found->second;
    };
    for (const auto* one : {&now, &before})
        for (const auto& [name, value] : *one)
            if (const std::string was = value_in(before, name), is = value_in(now, name); was != is)
                return fmt::format("{} was {} and is {}", name, quoted(was), quoted(is));
    return {};
}

} // namespace hexopt
