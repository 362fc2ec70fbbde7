#include "command.hpp"
#include "unused_pages.hpp"

#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>

namespace {

using namespace hexopt;

/// CLI11's own words for options that are given twice, or without what they need, count arguments.
std::string reason_of(const CLI::ParseError& error) {
    const std::string reason = error.what();
    const std::size_t twice = reason.find(": At Most 1 required");
    if (twice != std::string::npos) return reason.substr(0, twice) + ": is given more than once";
    const std::size_t needed = reason.find(": 1 required ");
    if (needed == std::string::npos || !reason.ends_with(" missing")) return reason;
    return reason.substr(0, needed) + ": its value is missing";
}

/// "error: ..." and a hint, without CLI11's several lines.
int report_usage(const CLI::App& app, const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    const CLI::App* command = app.get_subcommands().empty() ? &app : app.get_subcommands().front();
    const std::string name = command == &app ? "hexopt-gpu" : "hexopt-gpu " + command->get_name();
    const std::string reason = reason_of(error);
    std::cerr << "error: " << reason << (reason.ends_with('.') ? " " : "; ") << "see " << name << " --help\n";
    return static_cast<int>(ErrorCode::usage);
}

int run(CLI::App& app, cli::Session& session, int argc, char** argv) {
    try {
        app.parse(argc, argv);
        if (app.get_subcommands().empty()) throw CLI::RequiredError("A command");
    } catch (const CLI::ParseError& error) {
        return report_usage(app, error);
    } catch (const std::bad_alloc&) {
        session.fail(make_error(ErrorCode::out_of_memory, "memory", "",
                                "not enough for this mesh: about 1 KB a cell is needed"));
    } catch (const std::exception& error) {
        session.fail(make_error(ErrorCode::bad_input, "unexpected", "", error.what()));
    }
    return session.exit_code();
}

} // namespace

int main(int argc, char** argv) {
    std::signal(SIGXFSZ, SIG_IGN); // a file beyond the limit is an error of that write, not the end
    cli::release_loaded_pages();
    cli::Session session;
    CLI::App app{"Hexahedral mesher and mesh optimizer on Vulkan and CPU", "hexopt-gpu"};
    app.set_version_flag("--version", "hexopt-gpu " HEXOPT_VERSION);
    app.require_subcommand(0, 1); // a missing one is reported after unknown arguments
#define HEXOPT_COMMAND(name) cli::add_##name(app, session);
#include "commands.def"
#undef HEXOPT_COMMAND
    const int code = run(app, session, argc, argv);
    std::cout.flush();
    if (std::fflush(stdout) != 0 || !std::cout) {
        session.fail(make_error(ErrorCode::output_failed, "standard output", "", "could not be written"));
        return code == 0 ? session.exit_code() : code;
    }
    return code;
}
