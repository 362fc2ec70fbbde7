#include "command.hpp"

#include <csignal>
#include <cstdio>

namespace {

hexopt::Context* g_context_for_signals = nullptr;

extern "C" void on_interrupt(int) {
    if (g_context_for_signals) g_context_for_signals->cancel();
}

} // namespace

void hexopt::cli::Session::fail(const Error& error) {
    std::fprintf(stderr, "error: %s\n", error.one_line().c_str());
    exit_code = static_cast<int>(error.code);
}

int main(int argc, char** argv) {
    using namespace hexopt;
    Context context;
    g_context_for_signals = &context;
    std::signal(SIGINT, on_interrupt);
    std::signal(SIGTERM, on_interrupt);

    cli::Session session;
    session.context = &context;
    CLI::App app{"Hexahedral mesh optimizer on Vulkan and CPU", "hexopt-gpu"};
    app.require_subcommand(1);
    app.set_version_flag("--version", "hexopt-gpu 0.1.0");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : static_cast<int>(ErrorCode::usage);
    }
    return session.exit_code;
}
