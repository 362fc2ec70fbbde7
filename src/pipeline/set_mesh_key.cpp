#include "pipeline/mesh_keys.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numeric>

namespace hexopt {

namespace {

using Kind = MeshKey::Kind;

Error usage_error(const std::string& where, std::string reason) {
    return make_error(ErrorCode::usage, "configuration", where, std::move(reason));
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i + 1;
        for (std::size_t k = 0; k < b.size(); ++k) {
            const std::size_t change = diagonal + (a[i] != b[k]);
            diagonal = row[k + 1];
            row[k + 1] = std::min({change, row[k] + 1, row[k + 1] + 1});
        }
    }
    return row.back();
}

Error unknown_key(std::string_view name, const std::string& where) {
    std::string nearest = "patches.NAME.size";
    std::size_t best = std::numeric_limits<std::size_t>::max();
    for (const MeshKey& key : mesh_keys()) {
        // Compared whole, without the section, which is easily forgotten, and as its flag, which may be
        // better known.
        const std::string_view last = std::string_view(key.name).substr(key.name.find('.') + 1);
        std::string flag = key.flag.substr(2);
        std::replace(flag.begin(), flag.end(), '-', '_');
        const std::string_view last_given = name.substr(name.find('.') + 1);
        const std::size_t distance = std::min({edit_distance(name, key.name), edit_distance(name, last) + 1,
                                               edit_distance(last_given, flag) + 1});
        if (distance < best) best = distance, nearest = key.name;
    }
    return usage_error(where, fmt::format("unknown key '{}'; did you mean '{}'?", name, nearest));
}

const char* describe(Kind kind) {
    constexpr std::array<const char*, 6> kNames = {"true or false", "a number",          "a whole number",
                                                   "a text",        "a list of numbers", "a list of texts"};
    return kNames[static_cast<std::size_t>(kind)];
}

bool has_kind(const ConfigValue& value, Kind kind) {
    switch (kind) {
    case Kind::yes_no:
        return std::holds_alternative<bool>(value);
    case Kind::number:
        return std::holds_alternative<double>(value);
    case Kind::whole:
        return std::holds_alternative<double>(value) &&
               std::get<double>(value) == std::floor(std::get<double>(value));
    case Kind::word:
        return std::holds_alternative<std::string>(value);
    case Kind::numbers:
        return std::holds_alternative<std::vector<double>>(value);
    case Kind::texts:
        return std::holds_alternative<std::vector<std::string>>(value);
    }
    return false;
}

/// "patches.NAME.size" and "patches.NAME.level"; the name may hold dots.
Status set_patch_key(MeshJob& job, std::string_view name, const ConfigValue& value,
                     const std::string& where) {
    const std::size_t begin = name.find('.') + 1, end = name.rfind('.');
    if (end < begin) return unknown_key(name, where);
    const std::string patch(name.substr(begin, end - begin));
    const std::string_view what = name.substr(end + 1);
    const bool is_size = what == "size";
    if (!is_size && what != "level")
        return usage_error(where, fmt::format("unknown key '{}'; patches have size and level", name));
    if (!has_kind(value, is_size ? Kind::number : Kind::whole))
        return usage_error(
            where, fmt::format("{} must be {}", name, describe(is_size ? Kind::number : Kind::whole)));
    const double x = std::get<double>(value);
    if (is_size ? !(x > 0) : !(x >= 0 && x <= 30))
        return usage_error(where,
                           fmt::format("{} {}", name, is_size ? "must be above 0" : "must lie in 0..30"));
    auto& patches = job.options.refine.patches;
    auto at =
        std::find_if(patches.begin(), patches.end(), [&](const PatchTarget& p) { return p.patch == patch; });
    if (at == patches.end()) at = patches.insert(at, PatchTarget{patch, {}});
    at->target = is_size ? TargetSize{x, -1} : TargetSize{0, static_cast<int>(x)};
    return Done{};
}

bool parse_number(std::string_view text, double& number) {
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), number);
    return code == std::errc() && end == text.data() + text.size() && std::isfinite(number);
}

} // namespace

Status set_mesh_key(MeshJob& job, std::string_view name, const ConfigValue& value, const std::string& where) {
    if (name.starts_with("patches.")) return set_patch_key(job, name, value, where);
    const auto& keys = mesh_keys();
    const auto key = std::find_if(keys.begin(), keys.end(), [&](const MeshKey& k) { return k.name == name; });
    if (key == keys.end()) return unknown_key(name, where);
    if (!has_kind(value, key->kind))
        return usage_error(where, fmt::format("{} must be {}", name, describe(key->kind)));
    if (const std::string wrong = key->set(job, value); !wrong.empty())
        return usage_error(where, fmt::format("{} {}", name, wrong));
    return Done{};
}

Result<ConfigValue> parse_value(const MeshKey& key, const std::string& text) {
    const Error wrong =
        usage_error(key.flag, fmt::format("'{}' is not {}", text,
                                          key.kind == Kind::yes_no ? "yes or no" : describe(key.kind)));
    if (key.kind == Kind::word) return ConfigValue(text);
    if (key.kind == Kind::texts) return ConfigValue(std::vector<std::string>{text});
    if (key.kind == Kind::yes_no) {
        if (text == "yes" || text == "true" || text == "on") return ConfigValue(true);
        if (text == "no" || text == "false" || text == "off") return ConfigValue(false);
        return wrong;
    }
    std::vector<double> list;
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        if (!parse_number(std::string_view(text).substr(begin, end - begin), list.emplace_back()))
            return wrong;
        begin = end + 1;
    }
    if (key.kind == Kind::numbers) return ConfigValue(list);
    if (list.size() != 1 || (key.kind == Kind::whole && list[0] != std::floor(list[0]))) return wrong;
    return ConfigValue(list[0]);
}

} // namespace hexopt
