#include "capi/context.hpp"

namespace {

hexopt_log_level level_of(hexopt::LogLevel level) {
    switch (level) {
    case hexopt::LogLevel::debug:
        return HEXOPT_LOG_DEBUG;
    case hexopt::LogLevel::info:
        return HEXOPT_LOG_INFO;
    case hexopt::LogLevel::warning:
        return HEXOPT_LOG_WARNING;
    case hexopt::LogLevel::error:
        return HEXOPT_LOG_ERROR;
    }
    return HEXOPT_LOG_ERROR;
}

} // namespace

hexopt_context::hexopt_context(const hexopt_context_options& options) : inner(options.threads, options.seed) {
    if (options.log)
        inner.set_log_sink(
            [log = options.log, user = options.user](hexopt::LogLevel level, std::string_view text) {
                log(user, level_of(level), std::string(text).c_str());
            });
    if (options.progress)
        inner.set_progress_sink([this, progress = options.progress, user = options.user](
                                    std::string_view stage, double fraction, std::string_view detail) {
            if (progress(user, std::string(stage).c_str(), fraction, std::string(detail).c_str()) != 0)
                inner.cancel();
        });
}

extern "C" {

uint32_t hexopt_interface_version(void) { return HEXOPT_VERSION; }

const char* hexopt_version_string(void) { return HEXOPT_VERSION_STRING; }

const char* hexopt_status_name(hexopt_status status) {
    return status == HEXOPT_INTERNAL ? "internal" : hexopt::name_of(static_cast<hexopt::ErrorCode>(status));
}

hexopt_status hexopt_context_create(const hexopt_context_options* options, hexopt_context** context) {
    if (!context) return HEXOPT_USAGE;
    *context = nullptr;
    hexopt_context_options known = HEXOPT_CONTEXT_OPTIONS_INIT;
    try {
        if (options) {
            const hexopt::Status read = hexopt::capi::read_struct(options, "hexopt_context_options", known);
            if (!read) return HEXOPT_USAGE;
        }
        if (known.threads < 0) return HEXOPT_USAGE;
        *context = new hexopt_context(known);
        return HEXOPT_OK;
    } catch (const std::bad_alloc&) {
        return HEXOPT_OUT_OF_MEMORY;
    } catch (...) {
        return HEXOPT_INTERNAL;
    }
}

void hexopt_context_destroy(hexopt_context* context) { delete context; }

void hexopt_context_cancel(hexopt_context* context) {
    if (context) context->inner.cancel();
}

const char* hexopt_context_message(const hexopt_context* context) {
    return context ? context->message.c_str() : "no context";
}

} // extern "C"
