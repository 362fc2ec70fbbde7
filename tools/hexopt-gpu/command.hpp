#pragma once

#include "core/context.hpp"
#include "core/result.hpp"

#include <CLI/CLI.hpp>

namespace hexopt::cli {

/// What every subcommand shares. `exit_code` is what the process returns.
struct Session {
    Context* context = nullptr;
    int exit_code = 0;
    /// Prints "error: ..." on stderr and sets the exit code.
    void fail(const Error& error);
};

// Each adds its subcommand with options and a callback; one file a subcommand (command_NAME.cpp).

} // namespace hexopt::cli
