#include "mesh_flags.hpp"

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

/// Flags that say the same in two ways; a flag and a key of the file do not: the flag counts more.
Status check_contradictions(const MeshFlags& flags) {
    if (flags.keys.contains("refine.size") && flags.keys.contains("refine.level"))
        return make_error(ErrorCode::usage, "configuration", "--level",
                          "says the same as --size; give one of them");
    const auto name_of = [](const std::string& text) { return text.substr(0, text.rfind('=')); };
    for (const std::string& size : flags.patch_sizes)
        for (const std::string& level : flags.patch_levels)
            if (name_of(size) == name_of(level))
                return make_error(
                    ErrorCode::usage, "configuration", "--patch-level",
                    fmt::format("says the same of '{}' as --patch-size; give one of them", name_of(size)));
    return Done{};
}

} // namespace

Status configure(const MeshFlags& flags, MeshJob& job, Context& context) {
    if (Status clear = check_contradictions(flags); !clear) return clear;
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

void add_mesh_flags(CLI::App& app, MeshFlagSet set, MeshFlags& flags) {
    const MeshJob defaults;
    for (const MeshKey& key : mesh_keys()) {
        const std::string section = key.name.substr(0, key.name.find('.'));
        if (set == MeshFlagSet::of_domain && !is_of_domain(key)) continue;
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
    if (set == MeshFlagSet::of_domain) return;
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
