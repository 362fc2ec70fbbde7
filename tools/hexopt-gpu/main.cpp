#include "command.hpp"

#include <cstdio>
#include <exception>
#include <new>

int main(int argc, char** argv) {
    using namespace hexopt;
    cli::Session session;
    CLI::App app{"Hexahedral mesh optimizer on Vulkan and CPU", "hexopt-gpu"};
    app.set_version_flag("--version", "hexopt-gpu " HEXOPT_VERSION);
    app.require_subcommand(1);
#define HEXOPT_COMMAND(name) cli::add_##name(app, session);
#include "commands.def"
#undef HEXOPT_COMMAND
    try {
        app.parse(argc, argv);
        std::fflush(stdout);
        if (std::ferror(stdout) != 0)
            session.fail(make_error(ErrorCode::output_failed, "stdout", "", "could not be written"));
    } catch (const CLI::ParseError& error) {
        if (app.exit(error, std::cout, std::cerr) == 0) return 0;
        return static_cast<int>(ErrorCode::usage);
    } catch (const std::bad_alloc&) {
        session.fail(
            make_error(ErrorCode::out_of_memory, "", "", "out of memory; a mesh needs about 1 KB a cell"));
    } catch (const std::exception& error) {
        session.fail(make_error(ErrorCode::bad_input, "", "", error.what()));
    }
    return session.exit_code();
}
