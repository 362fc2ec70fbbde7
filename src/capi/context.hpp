#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "hexopt/hexopt.h"

#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <type_traits>

/// What the C interface's opaque handle points to.
struct hexopt_context {
    explicit hexopt_context(const hexopt_context_options& options);

    hexopt::Context inner;
    std::string message;
};

namespace hexopt::capi {

static_assert(HEXOPT_OUT_OF_MEMORY == static_cast<int>(ErrorCode::out_of_memory));
static_assert(HEXOPT_BELOW_TARGET == static_cast<int>(ErrorCode::below_target));

inline Error usage_error(std::string what, std::string reason) {
    return make_error(ErrorCode::usage, std::move(what), "", std::move(reason));
}

/// Copies the part of a caller's struct that both sides know over the defaults. Refuses structs from a newer
/// interface and sizes that cannot be.
template <class T>
Status read_struct(const T* given, const char* name, T& known) {
    static_assert(std::is_trivially_copyable_v<T>);
    constexpr std::size_t kHeader = offsetof(T, version) + sizeof(given->version);
    if (given->version == 0 || given->version > HEXOPT_VERSION)
        return usage_error(name, "version " + std::to_string(given->version) +
                                     " is unknown; use the INIT macro and a library at least as new");
    if (given->struct_size < kHeader || given->struct_size > sizeof(T))
        return usage_error(name, "struct_size " + std::to_string(given->struct_size) +
                                     " does not fit version " + std::to_string(given->version) +
                                     "; use the INIT macro");
    std::memcpy(&known, given, given->struct_size);
    return Done{};
}

/// Copies a result into a caller's struct, as much of it as the caller knows.
template <class T>
void write_struct(T value, T* given) {
    value.struct_size = given->struct_size;
    value.version = given->version;
    std::memcpy(given, &value, given->struct_size);
}

inline hexopt_status status_of(ErrorCode code) { return static_cast<hexopt_status>(code); }

/// Runs the body of a call: fresh cancel flag and progress, no exception gets out, the message is kept.
/// body() returns Status.
template <class Body>
hexopt_status guarded_call(hexopt_context* context, const Body& body) noexcept {
    if (!context) return HEXOPT_USAGE;
    try {
        context->message.clear();
        context->inner.restart();
        const Status status = body();
        if (status) return HEXOPT_OK;
        context->message = status.error().one_line();
        return status_of(status.error().code);
    } catch (const std::bad_alloc&) {
        context->message.assign("out of memory"); // short enough to need no allocation
        return HEXOPT_OUT_OF_MEMORY;
    } catch (const std::exception& error) {
        try {
            context->message = std::string("internal error: ") + error.what();
        } catch (const std::bad_alloc&) {
            context->message.assign("internal error");
        }
        return HEXOPT_INTERNAL;
    } catch (...) {
        context->message.assign("internal error");
        return HEXOPT_INTERNAL;
    }
}

} // namespace hexopt::capi
