"""Bonds of a stage at the request of its puppeteers, and the messages about them (proto/server.md, 6.3)."""

from __future__ import annotations

from bunraku.marionette.ownership import Ownership
from bunraku.session.puppeteer_roster import Puppeteer, PuppeteerRoster
from bunraku.wire.messages import Bond, BondEnd


class BondControl:
    """Bonds that the puppeteers of one stage request and end."""

    def __init__(self, ownership: Ownership, puppeteers: PuppeteerRoster) -> None:
        self._ownership = ownership
        self._puppeteers = puppeteers

    def receive(self, puppeteer: Puppeteer, message: Bond, now: int) -> bool:
        """Apply a request; return whether a bond has begun or ended. A refused one is answered with the reason."""
        first, second = message.limbs
        if not message.wanted:
            return self._ownership.unbond(first, second, puppeteer.id) and self.report_ended()
        refusal = self._ownership.bond(first, second, puppeteer.id, now)
        if refusal is not None:
            puppeteer.send(BondEnd(message.limbs, refusal).pack())
        return refusal is None

    def report_ended(self) -> bool:
        """Send the reason to the holders of hands whose bond has ended; return whether any bond has ended."""
        ended = self._ownership.take_ended_bonds()
        for bond, reason in ended:
            for holder in bond.holders:
                if (puppeteer := self._puppeteers.get(holder)) is not None:
                    puppeteer.send(BondEnd(list(bond.limbs), reason).pack())
        return bool(ended)
