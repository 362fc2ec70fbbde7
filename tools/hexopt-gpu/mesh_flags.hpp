#pragma once

#include "pipeline/mesh_keys.hpp"

#include <CLI/CLI.hpp>

#include <map>
#include <string>
#include <vector>

namespace hexopt::cli {

/// The configuration of meshing as the command line has it.
struct MeshFlags {
    std::string config;                                   ///< a file, which counts less than the flags
    std::vector<std::string> patch_sizes, patch_levels;   ///< NAME=VALUE
    std::map<std::string, std::vector<std::string>> keys; ///< texts of a key's flag, as often as given
};

/// Adds --config.
void add_config_flag(CLI::App& app, MeshFlags& flags);

enum class MeshFlagSet { all, of_domain };

/// Adds a flag for each key (of_domain: of those that a domain file settles), and those of patches.
void add_mesh_flags(CLI::App& app, MeshFlagSet set, MeshFlags& flags);

/// Takes over the file, then the flags.
Status configure(const MeshFlags& flags, MeshJob& job, Context& context);

} // namespace hexopt::cli
