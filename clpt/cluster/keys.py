"""Keys of a cluster: only processes with its keys can connect."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import platformdirs

from clpt.errors import ClusterError

if TYPE_CHECKING:
    from distributed.security import Security

FILE = "clpt-cluster.pem"


def default_folder() -> Path:
    """Return the default folder of a user's keys on a machine."""
    return platformdirs.user_state_path("clpt", appauthor=False) / "cluster"


def make(folder: Path) -> None:
    """Write the keys of a cluster, unless the folder has them: a file that only this user can read.

    The file holds a certificate, its key, and the authority that signed it. The authority's key is
    not kept, so nobody can issue a second certificate. Copy the folder to the machines of the
    cluster, by ssh for example. Raises ClusterError.
    """
    if (folder / FILE).exists():
        return
    try:
        import trustme
    except ImportError:
        raise ClusterError("a cluster needs keys: pip install 'clpt[cluster]'") from None
    authority = trustme.CA(organization_name="clpt cluster")
    certificate = authority.issue_cert("cluster.clpt")
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        descriptor, temporary = tempfile.mkstemp(dir=folder)  # only this user can read it
        try:
            with open(descriptor, "wb") as file:
                pem = certificate.private_key_and_cert_chain_pem.bytes()
                file.write(pem + authority.cert_pem.bytes())
            os.rename(temporary, folder / FILE)
        except BaseException:
            os.unlink(temporary)
            raise
    except OSError as error:
        raise ClusterError(f"{folder}: keys cannot be written: {error.strerror}") from None


def security(folder: Path | None = None) -> Security:
    """Return Dask's security object for the keys of a folder, by default this user's.

    Raises ClusterError without keys, and where other users can read or replace them.
    """
    from distributed.security import Security

    folder = default_folder() if folder is None else folder
    path = folder / FILE
    if not path.is_file():
        raise ClusterError(
            f"{folder} has no keys of a cluster: clpt cluster start makes them; "
            "give its folder by --keys on other machines"
        )
    if os.name == "posix":
        for checked, others in ((path, 0o077), (folder, 0o022)):
            if checked.stat().st_uid not in (os.getuid(), 0):
                raise ClusterError(f"{checked} belongs to another user")
            if checked.stat().st_mode & others:
                raise ClusterError(f"{checked} is open to others (see: chmod go= {checked})")
    roles = ("client", "scheduler", "worker")
    try:
        keys = Security(
            require_encryption=True, tls_ca_file=str(path),
            **{f"tls_{role}_cert": str(path) for role in roles},
        )  # fmt: skip
        keys.get_listen_args("scheduler")
    except OSError as error:
        raise ClusterError(f"{path} holds no keys of a cluster: {error}") from None
    return keys
