#include "mesh_flags.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace hexopt::cli {

namespace {

/// "NAME=VALUE" of --patch-size and --patch-level.
Status set_patch(MeshJob& job, const char* flag, const char* what, const std::string& text) {
    const std::size_t equals = text.rfind('=');
    double value = 0;
    const MeshKey number{"", flag, "", MeshKey::Kind::number, "", {}, {}};
    const auto parsed = equals == std::string::npos || equals == 0
                            ? Result<ConfigValue>(make_error(ErrorCode::usage, "configuration", flag,
                                                             fmt::format("'{}' is not NAME=VALUE", text)))
                            : parse_value(number, text.substr(equals + 1));
    if (!parsed) return parsed.error();
    value = std::get<double>(*parsed);
    return set_mesh_key(job, fmt::format("patches.{}.{}", text.substr(0, equals), what), value, flag);
}

} // namespace

Status configure(const MeshFlags& flags, MeshJob& job, Context& context) {
    if (!flags.config.empty())
        if (Status status = read_mesh_config(flags.config, job, context); !status) return status;
    for (const MeshKey& key : mesh_keys()) {
        const auto given = flags.keys.find(key.name);
        if (given == flags.keys.end()) continue;
        if (key.kind == MeshKey::Kind::texts) {
            if (Status status = set_mesh_key(job, key.name, given->second, key.flag); !status) return status;
            continue;
        }
        const auto value = parse_value(key, given->second.back());
        if (!value) return value.error();
        if (Status status = set_mesh_key(job, key.name, *value, key.flag); !status) return status;
    }
    for (const std::string& text : flags.patch_sizes)
        if (Status status = set_patch(job, "--patch-size", "size", text); !status) return status;
    for (const std::string& text : flags.patch_levels)
        if (Status status = set_patch(job, "--patch-level", "level", text); !status) return status;
    return Done{};
}

void add_config_flag(CLI::App& app, MeshFlags& flags) {
    app.add_option("-c,--config", flags.config, "Configuration (TOML); flags count more")
        ->type_name("FILE.toml");
}

void add_mesh_flags(CLI::App& app, const std::vector<std::string>& sections, MeshFlags& flags) {
    const MeshJob defaults;
    for (const MeshKey& key : mesh_keys()) {
        const std::string section = key.name.substr(0, key.name.find('.'));
        if (!sections.empty() && std::find(sections.begin(), sections.end(), section) == sections.end())
            continue;
        const ConfigValue standard = key.get(defaults);
        std::string value = std::visit(
            [](const auto& v) -> std::string {
                using T = std::decay_t<decltype(v)>;
                if constexpr (std::is_same_v<T, bool>)
                    return v ? "yes" : "no";
                else if constexpr (std::is_same_v<T, double> || std::is_same_v<T, std::string>)
                    return fmt::format("{}", v);
                else
                    return fmt::format("{}", fmt::join(v, ","));
            },
            standard);
        if (!value.empty()) value = " [" + value + "]";
        const bool is_list = key.kind == MeshKey::Kind::texts;
        app.add_option_function<std::vector<std::string>>(
               key.flag,
               [&flags, name = key.name](const std::vector<std::string>& texts) { flags.keys[name] = texts; },
               key.help + value + (is_list ? "; repeatable" : ""))
            ->type_name(key.type)
            ->allow_extra_args(false)
            ->multi_option_policy(is_list ? CLI::MultiOptionPolicy::TakeAll : CLI::MultiOptionPolicy::Throw)
            ->expected(is_list ? -1 : 1)
            ->group(section);
    }
    if (!sections.empty()) return;
    app.add_option("--patch-size", flags.patch_sizes,
                   "Longest edge of cells at one patch, model units; repeatable")
        ->type_name("NAME=X")
        ->allow_extra_args(false)
        ->group("refine");
    app.add_option("--patch-level", flags.patch_levels,
                   "Halvings of the initial mesh at one patch; repeatable")
        ->type_name("NAME=N")
        ->allow_extra_args(false)
        ->group("refine");
}

} // namespace hexopt::cli
