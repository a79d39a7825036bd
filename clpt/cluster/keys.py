"""Keys of a cluster: who has them may connect, and nobody else can read what is said."""

from __future__ import annotations

import datetime
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clpt import output_files
from clpt.errors import ClusterError

if TYPE_CHECKING:
    from distributed.security import Security

CA, CERTIFICATE, KEY = "ca.pem", "cluster.pem", "cluster-key.pem"
YEARS = 10


def make(folder: Path) -> None:
    """Make an authority, and a certificate of it with its key, unless the folder has them.

    Only this user can read the files. Copy the folder to the machines of the cluster, by ssh or
    alike. The key of the authority itself is not kept: nobody can make a second certificate.
    Raises ClusterError.
    """
    present = [name for name in (CA, CERTIFICATE, KEY) if (folder / name).exists()]
    if len(present) == 3:
        return
    if present:
        raise ClusterError(f"{folder}: {' and '.join(present)} without the others; delete them")
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.x509.oid import NameOID

    def name(text: str) -> x509.Name:
        return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])

    def certificate(subject: str, key: Any, signed_by: Any, is_ca: bool) -> bytes:
        now = datetime.datetime.now(datetime.timezone.utc)
        builder = (
            x509.CertificateBuilder()
            .subject_name(name(subject))
            .issuer_name(name("clpt cluster authority"))
            .public_key(key.public_key())
            .serial_number(x509.random_serial_number())
            .not_valid_before(now - datetime.timedelta(days=1))
            .not_valid_after(now + datetime.timedelta(days=365 * YEARS))
            .add_extension(x509.BasicConstraints(ca=is_ca, path_length=None), critical=True)
        )
        return builder.sign(signed_by, hashes.SHA256()).public_bytes(serialization.Encoding.PEM)

    authority, own = (ec.generate_private_key(ec.SECP256R1()) for _ in range(2))
    private = own.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        old = os.umask(0o077) if os.name == "posix" else 0
        try:
            output_files.write(
                folder / CA, certificate("clpt cluster authority", authority, authority, True)
            )
            output_files.write(
                folder / CERTIFICATE, certificate("clpt cluster", own, authority, False)
            )
            output_files.write(folder / KEY, private)
        finally:
            if os.name == "posix":
                os.umask(old)
    except OSError as error:
        raise ClusterError(f"{folder}: keys cannot be written: {error.strerror}") from None


def security(address: str, folder: Path | None) -> Security | None:
    """Return what Dask needs for an address: nothing for tcp://, the folder's keys for tls://.

    Raises ClusterError for tls:// without keys, and for keys with tcp://.
    """
    from distributed.security import Security

    if not address.startswith("tls://"):
        if folder is not None:
            raise ClusterError(f"{address} does not encrypt; keys are for tls://")
        return None
    if folder is None:
        raise ClusterError(f"{address} needs keys: give the folder that clpt cluster start made")
    files = {name: folder / name for name in (CA, CERTIFICATE, KEY)}
    for path in files.values():
        if not path.is_file():
            raise ClusterError(f"{path}: there is no such file of keys")
    if os.name == "posix" and files[KEY].stat().st_mode & 0o077:
        raise ClusterError(f"{files[KEY]} can be read by others (see: chmod go= {files[KEY]})")
    common = {"tls_ca_file": str(files[CA]), "require_encryption": True}
    roles = ("client", "scheduler", "worker")
    pairs = {f"tls_{role}_cert": str(files[CERTIFICATE]) for role in roles}
    pairs |= {f"tls_{role}_key": str(files[KEY]) for role in roles}
    return Security(**common, **pairs)
