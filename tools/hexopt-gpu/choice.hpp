#pragma once

#include <CLI/CLI.hpp>

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace hexopt::cli {

template <class T>
using Choices = std::vector<std::pair<std::string, T>>;

/// "a|b|c", as --help and the completion of the shell show what an option may be.
template <class T>
std::string list_of(const Choices<T>& choices) {
    std::string list;
    for (const auto& [name, value] : choices) list += (list.empty() ? "" : "|") + name;
    return list;
}

/// An option that is one of a few words, in any case.
template <class T>
CLI::Option* add_choice(CLI::App& command, const std::string& flag, T& target, const Choices<T>& choices,
                        const std::string& help) {
    const auto set = [&target, choices, flag](const std::string& text) {
        for (const auto& [name, value] : choices)
            if (CLI::detail::to_lower(text) == name) {
                target = value;
                return;
            }
        throw CLI::ValidationError(flag, "'" + text + "' must be one of " + list_of(choices));
    };
    return command.add_option_function<std::string>(flag, set, help)->type_name(list_of(choices));
}

} // namespace hexopt::cli
