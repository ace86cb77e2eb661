"""Readers of files and of replies that are not trusted."""

from ._mutation import Mutation

_FOLDER = "tests/rapi_jax/io/test_folder.py"
_SAFE = "tests/rapi_jax/io/test_safe.py"
_MODEL = "tests/rapi_jax/io/test_model_file.py"
_DRIVES = "tests/rapi_jax/io/test_drive_files.py"
_REPLIES = "tests/hardware/links/test_replies.py"
_REPLY = "hardware/links/_reply.py"

READERS = (
    Mutation(
        "io: MHz read as GHz",
        "rapi_jax/io/_units.py",
        '"MHz": ("GHz", 1e3)',
        '"MHz": ("GHz", 1.0)',
        _FOLDER,
    ),
    Mutation(
        "io: a response in the wrong unit",
        "rapi_jax/io/_units.py",
        "    if response > _RESPONSE_SPAN[1]:\n",
        "    if False:\n",
        _FOLDER,
    ),
    Mutation(
        "CSV: fewer samples than the manifest says",
        "rapi_jax/io/recordings/_csv.py",
        "if samples is not None and (len(rows) != samples or",
        "if samples is not None and (len(rows) > samples or",
        _FOLDER,
    ),
    Mutation(
        "CSV: a last line that breaks off",
        "rapi_jax/io/recordings/_csv.py",
        '        if not text.endswith("\\n"):\n            check_last_row',
        "        if False:\n            check_last_row",
        _FOLDER,
    ),
    Mutation(
        "CSV: a last number that jumps",
        "rapi_jax/io/_last_row.py",
        "if len(last[place].strip()) < shortest or jumps:",
        "if len(last[place].strip()) < shortest:",
        _FOLDER,
    ),
    Mutation(
        "CSV: a column named twice",
        "rapi_jax/io/recordings/_csv.py",
        "        if len(set(header)) < len(header):\n",
        "        if False:\n",
        _FOLDER,
    ),
    Mutation(
        "paths: `..` in a manifest",
        "rapi_jax/io/_safe.py",
        'windows.root or ".." in windows.parts or',
        "windows.root or",
        _SAFE,
    ),
    Mutation(
        "paths: a link out of the folder",
        "rapi_jax/io/_safe.py",
        "    if not real.is_relative_to(root):\n",
        "    if False:\n",
        _SAFE,
    ),
    Mutation(
        "text: a file of any length",
        "rapi_jax/io/_safe.py",
        "        if status.st_size > max_bytes:\n",
        "        if False:\n",
        _SAFE,
    ),
    Mutation(
        "HDF5: links are followed",
        "rapi_jax/io/recordings/_hdf5.py",
        "            if kind != 0:\n",
        "            if False:\n",
        _SAFE,
    ),
    Mutation(
        "HDF5: any ratio of declared to stored",
        "rapi_jax/io/recordings/_hdf5.py",
        "declared > MAX_DECLARED or declared > MAX_RATIO * stored:",
        "declared > MAX_DECLARED:",
        _SAFE,
    ),
    Mutation(
        "TOML: ten times as many dots",
        "rapi_jax/io/_toml.py",
        '.count(".") > _MAX_DOTS:',
        '.count(".") > 10 * _MAX_DOTS:',
        _FOLDER,
    ),
    Mutation(
        "model file: the checksum is not looked at",
        "rapi_jax/io/_model_file.py",
        "    if hashlib.sha256(body).hexdigest().encode() != tail:\n",
        "    if False:\n",
        _MODEL,
    ),
    Mutation(
        "model file: a parameter that is no number",
        "rapi_jax/io/_model_file.py",
        "            if np.isnan(value).any() or (",
        "            if (",
        _MODEL,
    ),
    Mutation(
        "model file: an infinite parameter",
        "rapi_jax/io/_model_file.py",
        "(np.isinf(value).any() and not free):",
        "False:",
        _MODEL,
    ),
    Mutation(
        "generator file: codes that are missing",
        "rapi_jax/io/drives/_drive_file.py",
        "codes.size != numbers[3]",
        "codes.size > numbers[3]",
        _DRIVES,
    ),
    Mutation(
        "drive file: a last line that breaks off",
        "rapi_jax/io/drives/_drive_file.py",
        '        if not text.endswith("\\n"):\n            check_last_row',
        "        if False:\n            check_last_row",
        _DRIVES,
    ),
    Mutation(
        "reply: of two answers the first",
        _REPLY,
        "    if rest:\n",
        "    if False:\n",
        _REPLIES,
    ),
    Mutation(
        "reply: a block that goes on",
        _REPLY,
        '        if tail != b"\\n":\n',
        "        if False:\n",
        _REPLIES,
    ),
    Mutation(
        "reply: a block of another size",
        _REPLY,
        "length > limit or (size is not None and length != size):",
        "length > limit:",
        _REPLIES,
    ),
    Mutation(
        "reply: 9.91E37 is a number",
        _REPLY,
        "    if not abs(value) < INFINITE:\n",
        "    if False:\n",
        _REPLIES,
    ),
    Mutation(
        "reply: a line without end",
        _REPLY,
        "        if len(got) > limit:\n",
        "        if False:\n",
        _REPLIES,
    ),
)
