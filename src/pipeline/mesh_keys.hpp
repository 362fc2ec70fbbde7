#pragma once

#include "pipeline/mesh_pipeline.hpp"

#include <functional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace hexopt {

/// A value of a key: a configuration file's, or a flag's after parse_value().
using ConfigValue = std::variant<bool, double, std::string, std::vector<double>, std::vector<std::string>>;

/// Something that `hexopt-gpu mesh` can be told, by a configuration file (NAME = "section.key") or a flag.
struct MeshKey {
    enum class Kind { yes_no, number, whole, word, numbers, texts };

    std::string name;
    std::string flag; ///< "--max-cells"
    std::string help; ///< one sentence with the unit, the range and what nothing means
    Kind kind;
    std::string type; ///< for --help: "X", "N", "yes|no", "a|b", "X,Y,Z"
    /// What the job has; an empty string or list stands for "not given".
    std::function<ConfigValue(const MeshJob&)> get;
    /// Takes over a value of the right kind; returns what is wrong with it, or nothing.
    std::function<std::string(MeshJob&, const ConfigValue&)> set;
};

/// All keys, in the order of the documentation, but for those of single patches ("patches.NAME.size" and
/// ".level").
const std::vector<MeshKey>& mesh_keys();

/// Whether the key says what is meshed, which a domain file settles.
bool is_of_domain(const MeshKey& key);

/// Sets one key. `where`: the flag, or the file and line. Errors (usage): an unknown key, with the nearest
/// known one; a value of the wrong kind or out of range.
Status set_mesh_key(MeshJob& job, std::string_view name, const ConfigValue& value, const std::string& where);

/// A flag's text as a value of the key's kind. Error (usage): it is none.
Result<ConfigValue> parse_value(const MeshKey& key, const std::string& text);

/// Takes over a configuration file (TOML). Errors: bad_input (no such file, a syntax error with its line),
/// usage as set_mesh_key().
Status read_mesh_config(const std::filesystem::path& path, MeshJob& job, Context& context);

/// The same of a text in memory; name: for messages.
Status read_mesh_config_text(std::string_view text, const std::string& name, MeshJob& job);

/// The job's configuration as TOML with every key, its meaning and its value; those that are not given as
/// comments. Reading it back gives the same job.
std::string dump_mesh_config(const MeshJob& job);

} // namespace hexopt
