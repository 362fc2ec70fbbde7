#include "io/file_bytes.hpp"
#include "pipeline/mesh_keys.hpp"

#include <fmt/format.h>

#define TOML_EXCEPTIONS 0
#define TOML_HEADER_ONLY 1
#include <toml++/toml.h>

namespace hexopt {

namespace {

std::string place_of(const std::string& file, const toml::source_region& source) {
    return fmt::format("{}:{}", file, source.begin.line);
}

/// false where the value is of no kind that a key has.
bool append_numbers(const toml::array& array, std::vector<double>& list) {
    for (const toml::node& item : array) {
        if (const toml::array* inner = item.as_array()) {
            if (!append_numbers(*inner, list)) return false;
        } else if (const auto number = item.value<double>(); number && item.is_number()) {
            list.push_back(*number);
        } else {
            return false;
        }
    }
    return true;
}

std::optional<ConfigValue> value_of(const toml::node& node) {
    if (const auto* yes = node.as_boolean()) return ConfigValue(yes->get());
    if (const auto* text = node.as_string()) return ConfigValue(text->get());
    if (node.is_number()) return ConfigValue(*node.value<double>());
    if (const auto* array = node.as_array();
        array && !array->empty() && array->is_homogeneous<std::string>()) {
        std::vector<std::string> texts;
        for (const toml::node& item : *array) texts.push_back(item.as_string()->get());
        return ConfigValue(texts);
    }
    std::vector<double> list;
    if (const auto* array = node.as_array(); array && append_numbers(*array, list)) return ConfigValue(list);
    return std::nullopt;
}

Status take_table(const toml::table& table, const std::string& prefix, const std::string& file,
                  MeshJob& job) {
    for (const auto& [key, node] : table) {
        const std::string name = prefix + std::string(key.str());
        if (const toml::table* inner = node.as_table()) {
            if (Status status = take_table(*inner, name + ".", file, job); !status) return status;
            continue;
        }
        const std::string where = place_of(file, node.source());
        const auto value = value_of(node);
        if (!value)
            return make_error(
                ErrorCode::usage, "configuration", where,
                fmt::format("{} is neither a number, a text, true or false, nor a list of numbers", name));
        if (Status status = set_mesh_key(job, name, *value, where); !status) return status;
    }
    return Done{};
}

std::string quoted(const std::string& text) {
    std::string out = "\"";
    for (char c : text) {
        if (c == '"' || c == '\\') out += '\\';
        if (static_cast<unsigned char>(c) < ' ')
            out += fmt::format("\\u{:04X}", static_cast<unsigned>(c));
        else
            out += c;
    }
    return out + "\"";
}

std::string to_toml(const ConfigValue& value) {
    if (const bool* yes = std::get_if<bool>(&value)) return *yes ? "true" : "false";
    if (const double* number = std::get_if<double>(&value)) return fmt::format("{}", *number);
    if (const auto* text = std::get_if<std::string>(&value)) return quoted(*text);
    if (const auto* texts = std::get_if<std::vector<std::string>>(&value)) {
        std::string list;
        for (const std::string& item : *texts) list += (list.empty() ? std::string() : ", ") + quoted(item);
        return "[" + list + "]";
    }
    return fmt::format("[{}]", fmt::join(std::get<std::vector<double>>(value), ", "));
}

bool is_given(const ConfigValue& value) {
    if (const auto* text = std::get_if<std::string>(&value)) return !text->empty();
    if (const auto* list = std::get_if<std::vector<double>>(&value)) return !list->empty();
    if (const auto* texts = std::get_if<std::vector<std::string>>(&value)) return !texts->empty();
    return true;
}

} // namespace

Status read_mesh_config(const std::filesystem::path& path, MeshJob& job, Context& context) {
    const Result<FileBytes> bytes = read_file(path, context);
    if (!bytes) return bytes.error();
    return read_mesh_config_text(bytes->view(), path.string(), job);
}

Status read_mesh_config_text(std::string_view text, const std::string& name, MeshJob& job) {
    const toml::parse_result parsed = toml::parse(text, name);
    if (!parsed)
        return make_error(ErrorCode::bad_input, "configuration", place_of(name, parsed.error().source()),
                          std::string(parsed.error().description()));
    return take_table(parsed.table(), "", name, job);
}

std::string dump_mesh_config(const MeshJob& job) {
    std::string text = "# Configuration of hexopt-gpu mesh. Lengths in model units, angles in degrees.\n";
    std::string section;
    for (const MeshKey& key : mesh_keys()) {
        const std::size_t dot = key.name.find('.');
        if (key.name.substr(0, dot) != section) {
            section = key.name.substr(0, dot);
            text += fmt::format("\n[{}]\n", section);
        }
        const ConfigValue value = key.get(job);
        const std::string name = key.name.substr(dot + 1);
        text += fmt::format("# {} ({})\n", key.help, key.type);
        text +=
            is_given(value) ? fmt::format("{} = {}\n", name, to_toml(value)) : fmt::format("# {} =\n", name);
    }
    for (const PatchTarget& patch : job.options.refine.patches) {
        text += fmt::format("\n[patches.{}]\n", quoted(patch.patch));
        text += patch.target.level >= 0 ? fmt::format("level = {}\n", patch.target.level)
                                        : fmt::format("size = {}\n", patch.target.size);
    }
    return text;
}

} // namespace hexopt
