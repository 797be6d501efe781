"""Runtime of kernels' code in LLVM's language: in place of Numba's, and between a block of words and a kernel."""

from typing import Final

# Numba's runtime for code that owns all of its memory: (references, destructor, its data, memory, size, allocator),
# as in numba/core/runtime/nrt.cpp; the memory of an array lies behind that, the memory of a list elsewhere.
RUNTIME: Final = """
%block = type { i64, ptr, ptr, ptr, i64, ptr }
declare ptr @malloc(i64)
declare ptr @realloc(ptr, i64)
declare void @free(ptr)
define ptr @numba_unpickle(ptr %data, i32 %length, ptr %digest) {
  ret ptr null
}
define ptr @numba_runtime_build_excinfo_struct(ptr %description, ptr %arguments) {
  ret ptr null
}
define ptr @NRT_Allocate(i64 %size) {
  %p = call ptr @malloc(i64 %size)
  ret ptr %p
}
define void @NRT_Free(ptr %p) {
  call void @free(ptr %p)
  ret void
}
define ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align) {
  %wide = zext i32 %align to i64
  %room = add i64 %wide, 48
  %all = add i64 %room, %size
  %base = call ptr @malloc(i64 %all)
  %none = icmp eq ptr %base, null
  br i1 %none, label %out, label %got
got:
  %first = ptrtoint ptr %base to i64
  %behind = add i64 %first, %room
  %odd = urem i64 %behind, %wide
  %at = sub i64 %behind, %odd
  %data = inttoptr i64 %at to ptr
  store %block zeroinitializer, ptr %base
  store i64 1, ptr %base
  %d = getelementptr %block, ptr %base, i32 0, i32 3
  store ptr %data, ptr %d
  %s = getelementptr %block, ptr %base, i32 0, i32 4
  store i64 %size, ptr %s
  br label %out
out:
  ret ptr %base
}
define ptr @NRT_MemInfo_alloc(i64 %size) {
  %b = call ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 16)
  ret ptr %b
}
define void @NRT_MemInfo_call_dtor(ptr %b) {
  %f = getelementptr %block, ptr %b, i32 0, i32 1
  %dtor = load ptr, ptr %f
  %none = icmp eq ptr %dtor, null
  br i1 %none, label %out, label %end
end:
  %i = getelementptr %block, ptr %b, i32 0, i32 2
  %info = load ptr, ptr %i
  %d = getelementptr %block, ptr %b, i32 0, i32 3
  %data = load ptr, ptr %d
  %s = getelementptr %block, ptr %b, i32 0, i32 4
  %size = load i64, ptr %s
  call void %dtor(ptr %data, i64 %size, ptr %info)
  br label %out
out:
  call void @free(ptr %b)
  ret void
}
define internal void @touchline_varsize_dtor(ptr %data, i64 %size, ptr %info) {
  %none = icmp eq ptr %info, null
  br i1 %none, label %out, label %end
end:
  call void %info(ptr %data, i64 %size, ptr null)
  br label %out
out:
  call void @free(ptr %data)
  ret void
}
define ptr @NRT_MemInfo_new_varsize_dtor(i64 %size, ptr %dtor) {
  %base = call ptr @malloc(i64 48)
  %data = call ptr @malloc(i64 %size)
  store %block zeroinitializer, ptr %base
  store i64 1, ptr %base
  %f = getelementptr %block, ptr %base, i32 0, i32 1
  store ptr @touchline_varsize_dtor, ptr %f
  %i = getelementptr %block, ptr %base, i32 0, i32 2
  store ptr %dtor, ptr %i
  %d = getelementptr %block, ptr %base, i32 0, i32 3
  store ptr %data, ptr %d
  %s = getelementptr %block, ptr %base, i32 0, i32 4
  store i64 %size, ptr %s
  ret ptr %base
}
define ptr @NRT_MemInfo_new_varsize(i64 %size) {
  %b = call ptr @NRT_MemInfo_new_varsize_dtor(i64 %size, ptr null)
  ret ptr %b
}
define ptr @NRT_MemInfo_varsize_alloc(ptr %b, i64 %size) {
  %data = call ptr @malloc(i64 %size)
  %d = getelementptr %block, ptr %b, i32 0, i32 3
  store ptr %data, ptr %d
  %s = getelementptr %block, ptr %b, i32 0, i32 4
  store i64 %size, ptr %s
  ret ptr %data
}
define ptr @NRT_MemInfo_varsize_realloc(ptr %b, i64 %size) {
  %d = getelementptr %block, ptr %b, i32 0, i32 3
  %old = load ptr, ptr %d
  %data = call ptr @realloc(ptr %old, i64 %size)
  store ptr %data, ptr %d
  %s = getelementptr %block, ptr %b, i32 0, i32 4
  store i64 %size, ptr %s
  ret ptr %data
}
define void @NRT_MemInfo_varsize_free(ptr %b, ptr %data) {
  call void @free(ptr %data)
  %d = getelementptr %block, ptr %b, i32 0, i32 3
  %own = load ptr, ptr %d
  %same = icmp eq ptr %own, %data
  br i1 %same, label %clear, label %out
clear:
  store ptr null, ptr %d
  br label %out
out:
  ret void
}
"""


# The function that is called: null, or the address of what describes the exception.
CALL: Final = """
declare i32 @"{inner}"(ptr, ptr, ptr)
define ptr @"{name}"(ptr %block) {{
  %result = alloca ptr
  %error = alloca ptr
  store ptr null, ptr %result
  store ptr null, ptr %error
  %code = call i32 @"{inner}"(ptr %result, ptr %error, ptr %block)
  %well = icmp eq i32 %code, 0
  %none = icmp eq i32 %code, -2
  %good = or i1 %well, %none
  %described = load ptr, ptr %error
  %answer = select i1 %good, ptr null, ptr %described
  ret ptr %answer
}}
"""
